"""Searches: tests that draw examples at random. A run of drills ends with what each has drawn and found."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import pytest

# Parameters of a test by which a search draws: a number of a random scene, mechanism or fault.
_SEEDS = ("seed", "first", "number")
_DRAWN, _SEED = "drawn", "seed"
_COUNTED = re.compile(r"(\d+) (?:passing|failing)")
_EXAMPLE = re.compile(r"(?:Failing test case|Falsifying example): (.*)", flags=re.DOTALL)
# Characters shown of an example or of a failure.
_LONGEST = 300


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Records how many examples a search has drawn, and from which seed."""
    result = yield
    statistics = getattr(item, "hypothesis_statistics", "")
    parameters = getattr(getattr(item, "callspec", None), "params", {})
    seeds = {name: parameters[name] for name in _SEEDS if name in parameters}
    if statistics:
        item.user_properties.append((_DRAWN, sum(map(int, _COUNTED.findall(statistics)))))
    elif seeds:
        item.user_properties.append((_DRAWN, 1))
        item.user_properties.append((_SEED, ", ".join(f"{name} {value}" for name, value in seeds.items())))
    return result


def _example(report: Any) -> str:
    """Text of an example that hypothesis found, or of the failure, in one line."""
    message = getattr(getattr(report.longrepr, "reprcrash", None), "message", str(report.longreprtext))
    found = _EXAMPLE.search(message)
    return " ".join((found[1] if found else message).split())[:_LONGEST]


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Prints a line for each search and each finding, where drills were run."""
    expression = str(terminalreporter.config.option.markexpr)
    if "drill" not in expression or "not drill" in expression:
        return
    reports = [report for found in terminalreporter.stats.values() for report in found if hasattr(report, "when")]
    told = {report.nodeid: dict(report.user_properties) for report in reports if report.when == "teardown"}
    failed = {report.nodeid: report for report in reports if report.failed}
    searches: dict[str, list[str]] = defaultdict(list)
    for name, properties in told.items():
        if _DRAWN in properties:
            searches[name.partition("[")[0]].append(name)
    if not searches:
        return
    terminalreporter.section("searches")
    terminalreporter.write_line(f"{'drawn':>7} {'found':>6}  search")
    for search, names in sorted(searches.items()):
        drawn = sum(int(told[name][_DRAWN]) for name in names)
        findings = [name for name in names if name in failed]
        terminalreporter.write_line(f"{drawn:7} {len(findings):6}  {search}")
        for name in findings:
            seed = told[name].get(_SEED, "")
            shown = ": ".join(filter(None, (name.partition("::")[2], seed, _example(failed[name]))))
            terminalreporter.write_line(f"{'':14}  {shown}")
