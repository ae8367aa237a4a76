"""The first slips of all engines as a table on the terminal."""

from __future__ import annotations

from typing import Any

from rich.table import Column, Table
from rich.text import Text

from proofroll.report.labels import number
from proofroll.report.screen import numeric, plain_table, unbroken


def onset_table(content: dict[str, Any]) -> Table:
    """One line per engine: its first slip with bracket, the difference from the truth, and the verdict."""
    table = plain_table(
        Column("engine", overflow="fold"),
        *numeric("first slip [s]"),
        *unbroken("between [s]"),
        *numeric("difference [s]"),
        Column("verdict", overflow="fold"),
    )
    for item in content["engines"]:
        first = item["onset"]
        bracket = f"{first['time_low']:.9g} … {first['time_high']:.9g}" if first else ""
        verdict = item["verdict"]
        if verdict in {"failed", "refused"}:
            verdict += f": {item['message']}"
        label = (item["name"], *(item["settings"].get(key, "") for key in ("formulation", "preset")))
        table.add_row(
            Text(" ".join(filter(None, label))),
            f"{first['time']:.9g}" if first else "none",
            bracket,
            number(item["difference"]),
            Text(verdict),
        )
    return table
