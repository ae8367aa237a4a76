"""The verdict table and other tables on the terminal, within 100 columns."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

WIDTH = 100
SYMBOLS = {"agrees": "✓", "converges": "≈", "differs": "✗", "failed": "!"}
_STYLES = {"agrees": "green", "converges": "yellow", "differs": "red", "failed": "bold red"}


def console() -> Console:
    """The console for data, on standard output; never wider than 100 columns."""
    out = Console(highlight=False)
    out.width = min(out.width, WIDTH) if out.is_terminal else WIDTH
    return out


def number(value: float | None, digits: int = 2) -> str:
    """A number in few characters, a dash for none."""
    return "–" if value is None else f"{value:.{digits}g}"


def verdict_table(content: dict[str, Any]) -> Table:
    """One line per engine with settings: the worst over all points of the parameters."""
    names = _columns(content)
    table = Table(title=Text(content["title"]), title_justify="left", box=None, pad_edge=False)
    table.add_column("engine, formulation, setting", no_wrap=True)
    table.add_column("step", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for name, unit in names:
        table.add_column(Text(f"{name} [{unit}]"), justify="right", no_wrap=True)
    table.add_column("order", justify="right", no_wrap=True)
    table.add_column("s/s", justify="right", no_wrap=True)
    table.add_column("expected", no_wrap=True)
    for row in content["rows"]:
        verdict = row["verdict"]
        observables = row["observables"]
        first: dict[str, Any] = next((observables[name] for name, _ in names if name in observables), {})
        table.add_row(
            Text(" ".join(filter(None, (row["name"], row["formulation"], row["preset"])))),
            f"{row['resolution']} {row['resolution_value']:.0e}" if row["resolution"] else "",
            Text(f"{SYMBOLS[verdict]} {verdict}", style=_STYLES[verdict]),
            *(number(observables[name]["error"] if name in observables else None) for name, _ in names),
            number(first.get("order")),
            number(row["seconds_per_second"]),
            Text("yes") if row["as_expected"] else Text("NO", style="bold red"),
        )
    return table


def _columns(content: dict[str, Any]) -> list[tuple[str, str]]:
    """The observables that fit on the terminal: the last coordinate, the normal force and a friction component."""
    units: dict[str, str] = {}
    for row in content["rows"]:
        for name, judgement in row["observables"].items():
            units[name] = judgement["unit"]
    coordinates = [name for name in units if name not in {"N", "F2", "F3"}]
    chosen = [*coordinates[1:2], "N", "F3"]
    return [(name, units[name]) for name in chosen if name in units]


def closing_lines(content: dict[str, Any]) -> list[str]:
    """What to look at first, in words."""
    rows = content["rows"]
    counts = {verdict: sum(row["verdict"] == verdict for row in rows) for verdict in SYMBOLS}
    said = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    lines = [f"{len(rows)} engine settings over {len(content['runs']) // max(1, len(rows))} cases each: {said}."]
    if content["contradictions"]:
        lines.append(f"{len(content['contradictions'])} findings contradict what {content['name']} expects; first:")
        lines += [f"  {sentence}" for sentence in content["contradictions"][:5]]
    else:
        lines.append("Every verdict is as the comparison file expects.")
    return lines
