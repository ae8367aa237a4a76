"""Outcomes of the faults as a table on the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.table import Table
from rich.text import Text

from proofroll_drill.arithmetic.matrix import Tried
from proofroll_drill.mutants.drilling import Mutated
from proofroll_drill.row import Drilled


def drill_table(rows: Sequence[Drilled]) -> Table:
    """One line per fault: whether it was contained, what it cost, and what was said about it."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("fault", no_wrap=True)
    table.add_column("contained", no_wrap=True)
    for name in ("others arrived", "kept", "recomputed"):
        table.add_column(name, justify="right")
    table.add_column("said")
    for row in rows:
        table.add_row(
            row.fault,
            Text("yes", style="green") if row.contained else Text("NO", style="bold red"),
            f"{row.others_arrived}/{row.others}",
            f"{row.kept}/{row.stored}",
            f"{row.recomputed}/{row.missing}",
            Text(row.said if row.contained else f"{row.said} ({row.problem})", overflow="fold"),
        )
    return table


def mutant_table(rows: Sequence[Mutated]) -> Table:
    """One line per mutant: whether it was detected, whether its fault was named, and what the diagnosis says."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("planted")
    table.add_column("detected", no_wrap=True)
    table.add_column("named", no_wrap=True)
    table.add_column("diagnosis")
    for row in rows:
        marks = [
            Text("yes", style="green") if yes else Text("NO", style="bold red") for yes in (row.detected, row.named)
        ]
        table.add_row(row.fault, *marks, Text(row.said or f"nothing proven; {row.by}", overflow="fold"))
    return table


def arithmetic_table(found: Sequence[Tried]) -> Table:
    """One line per kind of arithmetic: what was tried, and how much differs."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("arithmetic", no_wrap=True)
    for name in ("runs", "differences", "failed tests"):
        table.add_column(name, justify="right")
    table.add_column("")
    for item in found:
        if item.untried:
            table.add_row(item.kind, "", "", "", Text(f"not tried ({item.says}): {item.untried}", overflow="fold"))
            continue
        counts = [Text(str(len(found)), style="bold red" if found else "") for found in (item.differences, item.failed)]
        table.add_row(item.kind, str(item.runs), *counts, Text(item.says, overflow="fold"))
    return table


def arithmetic_lines(found: Sequence[Tried]) -> Iterator[str]:
    """Each run that ran out of time, each difference and each test that failed."""
    for item in found:
        yield from (f"{item.kind}: {run}: ran out of time, so it is compared with nothing" for run in item.late)
        for one in item.differences:
            yield f"{item.kind}: {one.comparison}: {one.what}: {one.found}, and in the reference {one.reference}"
        yield from (f"{item.kind}: {line}" for line in item.failed)
