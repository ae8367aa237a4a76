"""Slow tests without the mark ``drill``: named at the end of a run, which fails for them where none may be there.

The variable ``PROOFROLL_NO_DEAR``, which ``make test`` sets, makes the run fail; no single test fails for its duration.
On a slow or busy machine a time is divided by that of a loop that is measured beside it. What is needed once in a
process (an engine's modules, a truth that several tests hold) falls on the test that is the first to need it, which
depends on the tests that a process was given: a slow test is run a second time, and its time is that of the second run.
"""

from __future__ import annotations

import os
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
import seldom
from _pytest.runner import runtestprotocol
from share import is_of_the_day

VARIABLE = "PROOFROLL_NO_DEAR"
# Processor time [s] above which a test is a drill (CONTRIBUTING.md), on a processor that takes LOOP [s] for the loop.
LIMIT = 1.0
LOOP = 0.008
# Processor time [s] above which no first use excuses a test: it is not run again.
FIRST_USE = 5.0
# Largest number of tests named in the line.
_MOST = 10
_BEGAN = pytest.StashKey[float]()
_SHARED = pytest.StashKey[float]()
_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 1
_TOOK, _MARKED = "processor_seconds", "marked_drill"


def _of_children(process: str) -> float:
    """Processor time of a process's living descendants [s]; 0 except on Linux."""
    spent, children = 0.0, ""
    with suppress(OSError):  # a thread or a process that ends meanwhile: who waits for it counts it
        for thread in os.listdir(f"/proc/{process}/task"):
            children += _read(f"/proc/{process}/task/{thread}/children")
    for child in children.split():
        with suppress(OSError):
            fields = _read(f"/proc/{child}/stat").rpartition(")")[2].split()
            spent += sum(map(int, fields[11:15])) / _TICKS + _of_children(child)
    return spent


def _read(file: str) -> str:
    with open(file) as lines:
        return lines.read()


def _spent() -> float:
    """Processor time of this process and all its descendants, living and ended [s].

    Living ones count because a worker serves many tests: counted at its end, its time would fall on one test.
    """
    return sum(os.times()[:4]) + _of_children("self")


def _slowness() -> float:
    """Time of a loop of Python's numbers over LOOP, at least 1: the quickest of three."""
    times = []
    for _ in range(3):
        start, total = time.process_time(), 0.0
        for number in range(150_000):
            total += number * 0.5
        times.append(time.process_time() - start)
    return max(1.0, min(times) / LOOP)


def mark_drills(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Marks as drills what runs at night alone, and the cases of a test that its mark ``drill_of`` names.

    At night alone run cases that the mark ``nightly_of`` names, those that the mark ``daily`` does not name, and all
    but the share that the mark ``one_in`` leaves to the day. Drills of some folders get a mark besides. Where a single
    case is asked for, names are not compared with cases.

    Raises:
        pytest.UsageError: a mark names a case that its test has not.
    """
    named: dict[str, set[str]] = {}
    cases = defaultdict(set)
    for item in items:
        case = item.name.partition("[")[2].removesuffix("]")
        function = item.nodeid.partition("[")[0]
        place = len(cases[function])
        cases[function].add(case)
        drills, nightly, daily = (_names(item, mark) for mark in ("drill_of", "nightly_of", "daily"))
        if names := drills | nightly | daily:
            named[function] = names
        share = item.get_closest_marker("one_in")
        if case in nightly or (daily and case not in daily) or (share and not is_of_the_day(place, *share.args)):
            item.add_marker("nightly")
        if case in drills or item.get_closest_marker("nightly"):
            item.add_marker("drill")
        if item.get_closest_marker("drill") and (mark := seldom.mark_of(item.nodeid)):
            item.add_marker(mark)
    whole = not any("[" in argument for argument in config.args)
    for function, names in named.items() if whole else ():
        if unknown := names - cases[function]:
            raise pytest.UsageError(f"{function}: a mark names {', '.join(sorted(unknown))}, which it has not")


def _names(item: pytest.Item, mark: str) -> set[str]:
    """Cases that a mark of a test names."""
    return {name for found in item.iter_markers(mark) for name in found.args}


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest) -> Iterator[Any]:
    """Counts what tests share, for it is no time of the test that is the first to need it."""
    if fixturedef.scope == "function":
        return (yield)
    start = _spent()
    try:
        return (yield)
    finally:
        stash = request.session.stash
        stash[_SHARED] = stash.get(_SHARED, 0.0) + _spent() - start


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Runs a slow test without the mark ``drill`` again: its time is without what it was the first to need.

    Its result is that of the first run. A failed test is left to it.
    """
    if not _forbidden(item.config):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    reports = runtestprotocol(item, nextitem=nextitem, log=False)
    properties = dict(reports[-1].user_properties)
    seconds = properties[_TOOK]
    if not properties[_MARKED] and LIMIT < seconds < FIRST_USE and all(not report.failed for report in reports):
        second_run = runtestprotocol(item, nextitem=nextitem, log=False)
        seconds = min(seconds, dict(second_run[-1].user_properties)[_TOOK])
        reports[-1].user_properties.append((_TOOK, seconds))
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Notes when a test begins: where the one before it ended."""
    item.stash[_BEGAN] = item.session.stash.get(_BEGAN, None) or _spent()
    item.session.stash[_SHARED] = 0.0


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Records the processor time that a test took."""
    result = yield
    now = item.session.stash[_BEGAN] = _spent()
    took = now - item.stash.get(_BEGAN, now) - item.session.stash[_SHARED]  # a skipped test has no start
    item.user_properties.append((_TOOK, took / _slowness() if took > LIMIT else took))
    # Keywords of a report hold names of folders too: a test in tests/drill has the word, not the mark.
    item.user_properties.append((_MARKED, item.get_closest_marker("drill") is not None))
    return result


def _dear(terminalreporter: Any) -> dict[str, float]:
    """Processor times [s] of the slow tests without the mark ``drill``, by name, the slowest first."""
    reports = [report for found in terminalreporter.stats.values() for report in found if hasattr(report, "when")]
    told = {report.nodeid: dict(report.user_properties) for report in reports if report.when == "teardown"}
    took = {name: properties.get(_TOOK, 0.0) for name, properties in told.items() if not properties.get(_MARKED)}
    return {name: took[name] for name in sorted(took, key=lambda name: -took[name]) if took[name] > LIMIT}


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Prints the slow tests without the mark ``drill``."""
    if dear := _dear(terminalreporter):
        names = ", ".join(f"{name} ({seconds:.1f} s)" for name, seconds in list(dear.items())[:_MOST])
        failed = f" ({VARIABLE} is set, so this is a failure)" if _forbidden(terminalreporter.config) else ""
        terminalreporter.write_line(
            f"{len(dear)} without the mark drill took more than {LIMIT} s of processor{failed}: {names}"
        )


def _forbidden(config: pytest.Config) -> bool:
    """True for a run of the quick tests alone: beside drills their order decides which test needs what first."""
    return bool(os.environ.get(VARIABLE)) and config.option.markexpr == "not drill"


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fails the run of all quick tests if one of them is slow."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter and _forbidden(session.config) and exitstatus == pytest.ExitCode.OK and _dear(reporter):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
