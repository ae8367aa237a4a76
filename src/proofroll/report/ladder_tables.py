"""The ladder of models as two tables of the terminal."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from proofroll.report.labels import number
from proofroll.report.ladder import LadderContent, label
from proofroll.report.terminal import step
from proofroll.studies.term_worth import Worth

_SHORT = {Worth.NOT_NEEDED: "not needed"}
_STYLES = {Worth.NEEDED: "green", Worth.NOT_NEEDED: "yellow", Worth.HARMFUL: "red", Worth.NO_ANSWER: "bold red"}


def ladder_parts(content: LadderContent) -> list[Table | str]:
    """Both tables, and what to take home."""
    return [rung_table(content), "", term_table(content), "", *content.findings]


def rung_table(content: LadderContent) -> Table:
    """One line per rung, from the least model to the most."""
    title = f"{content.quantity} of {content.scene} over {content.until:g} s, from the least model to the most"
    table = Table(title=Text(title), title_justify="left", box=None, padding=(0, 1, 0, 0))
    for column in ("level", "engine formulation", "step"):
        table.add_column(column, no_wrap=True)
    for column in (f"error [{content.unit}]", "s/s", "low … high"):
        table.add_column(Text(column), justify="right", no_wrap=True)
    for rung in content.rungs:
        speed = rung.ran.seconds_per_second
        if rung.ran.error is None:
            table.add_row(rung.level, Text(label(rung) or "–"), Text(rung.ran.status))
            continue
        table.add_row(
            rung.level,
            Text(label(rung)),
            Text(step(rung.resolution, rung.resolution_value)),
            number(rung.ran.error),
            number(speed.value if speed else None),
            f"{speed.low:.2g} … {speed.high:.2g}" if speed else "",
        )
    return table


def term_table(content: LadderContent) -> Table:
    """One line per term and model: what it costs, what leaving it out does, and the verdict."""
    table = Table(title=Text("Terms, with and without"), title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("term", max_width=25)
    table.add_column("engine formulation", no_wrap=True)
    unit = content.unit
    for column in ("cost", f"with [{unit}]", "without", "moves"):
        table.add_column(Text(column), justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for row in content.terms:
        table.add_row(
            Text(row.term),
            Text(label(row)),
            f"{row.cost.value:.2f}×" if row.cost else "–",
            *(number(side.ran.error if side else None) for side in (row.on, row.off)),
            number(row.change),
            Text(_SHORT.get(row.verdict, row.verdict.value), style=_STYLES.get(row.verdict, "")),
        )
    return table
