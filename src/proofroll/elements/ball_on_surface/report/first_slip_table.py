"""The first slips of all engines as a table on the terminal."""

from __future__ import annotations

from typing import Any

from rich.table import Table
from rich.text import Text

from proofroll.report.labels import number


def onset_table(content: dict[str, Any]) -> Table:
    """One line per engine: its first slip with bracket, the difference from the truth, and the verdict."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("engine", overflow="fold")
    table.add_column(Text("first slip [s]"), justify="right", no_wrap=True)
    table.add_column(Text("between [s]"), no_wrap=True)
    table.add_column(Text("difference [s]"), justify="right", no_wrap=True)
    table.add_column("verdict", overflow="fold")
    for item in content["engines"]:
        first = item["onset"]
        bracket = f"{first['time_low']:.9g} … {first['time_high']:.9g}" if first else ""
        verdict = item["verdict"]
        if verdict in {"failed", "refused"}:
            verdict += f": {item['message']}"
        settings = item["settings"]
        label = (item["name"], settings.get("formulation", ""), settings.get("preset", ""))
        table.add_row(
            Text(" ".join(filter(None, label))),
            f"{first['time']:.9g}" if first else "none",
            bracket,
            number(item["difference"]),
            Text(verdict),
        )
    return table
