"""Table of throughput on the terminal."""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table
from rich.text import Text

from proofroll.core.number_format import number, spaced
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll_throughput.study import Throughput, ThroughputRow


def heading(result: Throughput) -> str:
    """Sentence about the scenes, the errors and the cost."""
    ends = f"{result.values[0]:g} to {result.values[-1]:g}"
    bar = f"{number(result.error_bar)}{spaced(result.unit)}"
    return (
        f"{result.scene}, {len(result.values)} values of {result.parameter} from {ends}, {result.until:g} s; errors in "
        f"{result.quantity}, whose truths have an error bar of {bar}\n"
    )


def table_of(result: Throughput) -> Table:
    """Table with a line for each row that was measured."""
    unit = "" if result.unit == "1" else f" [{result.unit}]"
    table = plain_table(
        *unbroken("engine"),
        *numeric("copies", f"worst{unit}", result.parameter, "twins", "NaN", "µs", "s before"),
    )
    for row in result.rows:
        if row.device:
            table.add_row(Text(row.name), *_cells(row))
    return table


def _cells(row: ThroughputRow) -> list[str]:
    """Cells of a row behind its name."""
    twins = number(row.twins_apart) if row.twins_apart is None or row.twins_apart else "0"
    value = "–" if row.worst_value is None else f"{row.worst_value:.4g}"
    copies = f"{row.copies}{' in turn' if row.in_turn else ''}"
    cost = number(row.microseconds, 3)
    return [copies, number(row.worst), value, twins, str(row.not_finite or ""), cost, number(row.seconds_before)]


def closing_lines(result: Throughput) -> Iterator[str]:
    """Lines about the columns, about runs one after the other, and about rows without a result."""
    devices = ", ".join(sorted({row.device for row in result.rows if row.device}))
    where = f"{devices} ({result.machine['processor']}), {result.date}"
    yield f"\nµs: processor time of a copy and step; s before: up to the end of the first step. On {where}."
    turns: dict[str, list[str]] = {}
    for row in result.rows:
        if row.in_turn:
            turns.setdefault(row.in_turn, []).append(row.name)
    for why, names in turns.items():
        yield f"One after the other ({why}): {'; '.join(names)}."
    for row in result.rows:
        if row.message:
            copies = f", {row.copies} copies" if row.copies else ""
            yield f"{row.name}{copies}: {row.message}"
