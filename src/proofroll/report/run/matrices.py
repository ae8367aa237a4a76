"""Matrices of the equations of motion, as lines for a terminal."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from proofroll.report.kinds import EquationMatrices

if TYPE_CHECKING:
    from rich.table import Table


def matrix_lines(content: EquationMatrices) -> "Iterator[Table | str]":
    """Table of M, h and g with a row for each velocity, and how far they are from the truth's."""
    from rich.table import Table
    from rich.text import Text

    yield "M v' + h + g = tau at the start, in the velocities of the joints:"
    table = Table(box=None, pad_edge=False)
    table.add_column("velocity")
    names = [Text(name) for name in content.velocities]
    for heading in (*names, Text("h"), Text("g")):
        table.add_column(heading, justify="right")
    for number, name in enumerate(names):
        row = [] if content.M is None else content.M[number]
        ends = (part[number] for part in (content.h, content.g) if part is not None)
        table.add_row(name, *(f"{value:.8g}" for value in (*row, *ends)))
    yield table
    if content.differences:
        shown = ", ".join(f"{name} {value:.1g}" for name, value in content.differences.items())
        yield f"differences from the truth's, relative to their largest entries: {shown}"
