"""Tables of the benchmarks on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.table import Table
from rich.text import Text

from proofroll.report.terminal import number

_MEANING = {
    "reduced_over_engine": "reduced, against the fastest engine",
    "reduced_over_contact": "reduced, against the fastest contact model",
    "projection_euler": "projection euler, against numpy and scipy",
    "projection_rotating_frame": "projection rotating_frame, against numpy and scipy",
}


def reference_tables(content: dict[str, Any]) -> Iterator[Table]:
    """What was run, how many times faster it is, and whether that is what was wanted."""
    slip = content["first_slip"]["seconds"]
    runs = _table(f"To the first slip at {slip:.6f} s", "", "error [m]", "time [ms]", "95 %", "built in [s]")
    for row in [*content["models"], *content["engines"]]:
        seconds = row["seconds"]
        runs.add_row(
            row["name"],
            f"{row['error']:.1e}",
            number(1e3 * seconds["value"], 3),
            f"{number(1e3 * seconds['low'])} … {number(1e3 * seconds['high'])}",
            number(row.get("build_seconds")),
        )
    yield runs
    ratios = _table("How many times faster", "", "ratio", "95 %", "goal", "")
    for name, found in content["ratios"].items():
        ratios.add_row(_MEANING[name], *_measured(found))
    found = content["onsets_per_second"]
    ratios.add_row("first slips in bulk, per second of one core", *_measured(found))
    yield ratios


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=None, padding=(0, 2, 0, 0))
    for index, column in enumerate(columns):
        table.add_column(Text(column), justify="left" if index == 0 else "right", no_wrap=True)
    return table


def _measured(found: dict[str, Any]) -> tuple[str, str, str, str]:
    mark = "✓" if found["met"] else "✗"
    if found["value"] is None:
        return "–", "", f"{found['goal']:,.0f}", mark
    ends = f"{found['low']:,.0f} … {found['high']:,.0f}"
    return f"{found['value']:,.0f}", ends, f"{found['goal']:,.0f}", mark
