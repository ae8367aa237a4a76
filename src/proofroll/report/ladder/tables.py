"""Tables of the ladder of models for the terminal."""

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import number
from proofroll.report.labels import step
from proofroll.report.ladder.ladder import LadderContent, label
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll.studies.ladder.models import Need

_SHORT = {Need.NOT_NEEDED: "not needed"}
_STYLES = {Need.NEEDED: "green", Need.NOT_NEEDED: "yellow", Need.HARMFUL: "red", Need.NO_ANSWER: "bold red"}


def ladder_parts(content: LadderContent) -> list[Table | str]:
    """Both tables, and the conclusions."""
    return [rung_table(content), "", term_table(content), "", *content.findings]


def rung_table(content: LadderContent) -> Table:
    """Table of the rungs, from the simplest model to the most complete."""
    title = f"{content.quantity} of {content.scene} over {content.until:g} s, from the least model to the most"
    table = plain_table(
        *unbroken("level", "engine formulation", "step"),
        *numeric(f"error [{content.unit}]", "s/s", "low … high"),
        title=title,
    )
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
    """Table of terms and models: cost of the term, effect of leaving it out, and the verdict."""
    table = plain_table(
        Column("term", max_width=25),
        *unbroken("engine formulation"),
        *numeric("cost", f"with [{content.unit}]", "without", "moves"),
        *unbroken("verdict"),
        title="Terms, with and without",
    )
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
