"""Statements of an article as rows of tables on a page and on the terminal."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import number
from proofroll.report.labels import unit
from proofroll.report.terminal.screen import numeric, plain_table, unbroken

_SIGNS = {True: ("✓", "green"), False: ("✗", "bold red"), None: ("–", "")}


def count(statements: Sequence[Mapping[str, Any]]) -> str:
    """Count of the statements that hold, those of the article apart from this project's own."""
    parts = []
    for ours, whose in ((False, "statements"), (True, "of this project's own")):
        verdicts = [item["holds"] for item in statements if item["ours"] is ours]
        if verdicts:
            parts.append(f"{verdicts.count(True)} of {len(verdicts)} {whose}")
    return f"{' and '.join(parts)} hold"


def titled(name: str) -> str:
    """A figure's name as a heading: ``figure3`` is ``Figure 3``."""
    return re.sub(r"(?<=[a-z])(?=\d)", " ", name.replace("_", " ")).capitalize()


def rows(study: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of an article's statements and the runs' values, one line for each run."""
    lines, previous = [], None
    for item in study["statements"]:
        of = unit(item["unit"])
        lines.append(
            {
                **item,
                "first": item["says"] != previous,
                "runs": ", ".join(item["runs"]),
                "found": _said(item["found"], of),
                "truth": _said(item["truth"], of),
            }
        )
        previous = item["says"]
    return lines


def statement_table(content: dict[str, Any]) -> Table:
    """Table of statements, values and verdicts, one line for each."""
    found_column = Column("found", justify="right", max_width=24)
    table = plain_table(
        Column("statement"), *unbroken("run"), *numeric("stated"), found_column, *unbroken(""), title=content["title"]
    )
    previous = ""
    for item in content["statements"]:
        sign, look = _SIGNS[item["holds"]]
        # Several runs are compared by order: the numbers show it, and the names of runs are in the JSON.
        runs = item["runs"][0] if len(item["runs"]) == 1 else f"{len(item['runs'])} runs"
        table.add_row(
            Text("" if item["says"] == previous else item["says"]),
            Text(runs),
            Text(item["stated"]),
            Text(_said(item["found"], unit(item["unit"]))),
            Text(sign, style=look),
        )
        previous = item["says"]
    return table


def _said(value: Any, of: str) -> str:
    if value is None:
        return "–"
    if isinstance(value, list):
        parts = [part if isinstance(part, str) else number(part, 3) for part in value]
        return f"{', '.join(parts)} {of}".strip() if parts else "nothing"
    return f"{number(value, 7)} {of}".strip()
