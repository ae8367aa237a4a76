"""Numbers of a report's records besides its runs' errors, as lines of the long table: certificates, claims, maps."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import zip_longest
from typing import Any

from proofroll.report.long_table import TableLine

_BLANK = TableLine(
    study="", group="", scene="", place="", row=-1, engine="", version="", formulation="", preset="", setting="",
    precision="", own_equations=False, resolution="", step=None, status="", message="", verdict="", cost=None,
    cost_low=None, cost_high=None, clean=False,
)  # fmt: skip
# Fields of a record that name what its numbers belong to, and their columns.
_WORDS = {name: name for name in ("engine", "formulation", "preset", "setting", "quantity", "unit", "row")}
_WORDS |= {"point": "place", "resolution_value": "step"}
# Errors of runs have lines of their own, some of which summaries repeat; drawings and settings are no results.
_ELSEWHERE = {
    "judgements",
    "observables",
    "drawings",
    "versions",
    "measured",
    "error",
    "envelope",
    "rounds",
    "settings",
}
_CERTIFICATE = {"found", "expected", "difference", "standing"}
_NUMBER = re.compile(r"(?<![\w.])[-−]?\d")


def recorded_lines(content: Mapping[str, Any]) -> Iterator[TableLine]:
    """Line of each number in the records of a report's studies, whose ``record`` is its address in the study.

    Sentences with numbers are lines, too, with the sentence as ``message``.

    Args:
        content: of ``report.json``.
    """
    lists = (studies for studies in content.values() if isinstance(studies, list))
    for study in (item for studies in lists for item in studies if isinstance(item, dict)):
        if {"name", "scene"} <= study.keys():
            of = {"study": study["name"], "scene": study["scene"], "group": study.get("group", "")}
            yield from _numbers(study, "", replace(_BLANK, **of))


def _numbers(value: Any, address: str, line: TableLine) -> Iterator[TableLine]:
    """Lines of all numbers in a value, with what the records around it tell of them."""
    if isinstance(value, Mapping):
        words = {column: value[key] for key, column in _WORDS.items() if _fits(value.get(key), getattr(line, column))}
        if "formulation" in value and "name" in value:
            words["engine"] = value["name"]  # of a row, whose engine is written with its settings
        line = replace(line, **words)
        if value.keys() >= _CERTIFICATE:
            yield from _certified(value, address, line)
            return
        for key, item in value.items():
            if key not in _ELSEWHERE and key not in _WORDS:
                yield from _numbers(item, f"{address}.{key}".removeprefix("."), line)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _numbers(item, f"{address}[{index}]", line)
    elif isinstance(value, str):
        if _NUMBER.search(value):
            yield replace(line, record=address, message=value)
    elif value is not None and not isinstance(value, bool):
        yield replace(line, record=address, value=value)


def _certified(line: Mapping[str, Any], address: str, blank: TableLine) -> Iterator[TableLine]:
    """A line for each component of a quantity of a certificate; one without a value if it is not reported."""
    blank = replace(blank, error=line["difference"], tolerance=line["tolerance"], verdict=line["standing"])
    values, expected = line["found"] or [None], line["expected"] or [None]
    for index, (value, target) in enumerate(zip_longest(values, expected)):
        yield replace(blank, record=f"{address}[{index}]", value=value, expected=target)


def _fits(value: Any, column: Any) -> bool:
    """True if a field can stand in a column: a name, or a number where the column has numbers."""
    return isinstance(value, str) if isinstance(column, str) else isinstance(value, (int, float))
