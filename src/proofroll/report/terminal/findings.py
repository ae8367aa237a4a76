"""Tables of findings about engines for the terminal."""

from collections.abc import Sequence

from rich.table import Column, Table
from rich.text import Text

from proofroll.report.terminal.screen import plain_table, unbroken
from proofroll.studies.findings import EngineFinding, FindingState, Shown

_STYLES = {
    FindingState.SHOWS: "red",
    FindingState.GONE: "green",
    FindingState.NOT_INSTALLED: "dim",
    FindingState.BROKEN: "yellow",
}


def findings_table(rows: Sequence[Shown]) -> Table:
    """Table with a line per finding: title, whether it shows in the installed version, output of its program."""
    table = plain_table(*_folded("finding"), *unbroken("state"), *_folded("installed", "said"))
    for row in rows:
        version = f"{row.finding.package} {row.version}".strip() if row.version else ""
        table.add_row(Text(row.finding.title), Text(row.state, style=_STYLES[row.state]), Text(version), Text(row.said))
    return table


def findings_list(findings: Sequence[EngineFinding]) -> Table:
    """Table with a line per finding: title, versions where it was seen, version without it, and public thread."""
    table = plain_table(*_folded("finding", "seen in", "gone in", "issue"))
    for item in findings:
        table.add_row(*(Text(text) for text in (item.title, item.seen, item.gone, item.issue)))
    return table


def _folded(*names: str) -> list[Column]:
    return [Column(name, overflow="fold") for name in names]
