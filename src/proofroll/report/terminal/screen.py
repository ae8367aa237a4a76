"""Console of the terminal, which text of engines and files must not control."""

import copy
import dataclasses
import os
from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Column, Table
from rich.text import Text

from proofroll.report.terminal.printable import printable

WIDTH, WIDEST = 80, 100  # columns of a command's answer, and of all else


class Screen(Console):
    """A console that sends no control characters to the terminal but those of its own styles."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """See :class:`rich.console.Console`."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)

    def print(self, *objects: Any, **options: Any) -> None:
        """Prints as :class:`rich.console.Console` does; columns that make a table too wide go below the others."""
        if len(objects) == 1 and isinstance(objects[0], Table):
            for part in fitted(objects[0], self):
                super().print(part, **options)
            if objects[0].caption:  # over the whole width, however narrow the table
                super().print(objects[0].caption, style="table.caption")
        else:
            super().print(*objects, **options)


def console() -> Screen:
    """Console for data on standard output: at most 100 columns of a terminal; in a pipe 100, or COLUMNS.

    Text is printed literally: ``[words]`` and ``:words:`` are not markup.
    """
    out = Screen(highlight=False, markup=False, emoji=False)
    if out.is_terminal:
        out.width = min(out.width, WIDEST)
    elif not os.environ.get("COLUMNS", "").isdecimal():  # else rich has read it
        out.width = WIDEST
    out.width = out.width or 80  # COLUMNS=0 means unknown
    return out


def plain_table(*columns: Column, title: str = "") -> Table:
    """Table without ruled lines."""
    return Table(*columns, title=Text(title), title_justify="left", box=None, padding=(0, 1, 0, 0))


def unbroken(*names: str) -> list[Column]:
    """Columns whose lines are not wrapped."""
    return [Column(Text(name), no_wrap=True) for name in names]


def numeric(*names: str) -> list[Column]:
    """Columns of numbers, right-aligned and not wrapped."""
    return [Column(Text(name), no_wrap=True, justify="right") for name in names]


_WIDEST = 10_000  # characters: a width at which nothing wraps


def fitted(table: Table, console: Console) -> list[Table]:
    """Parts of a table no wider than the console; no word is cut.

    Each part repeats the leading columns that distinguish the lines, or only the first if these leave no room for
    others.
    """
    if not table.columns:
        return [table]
    _, right, _, left = table.padding
    room, pad = console.width, left + right
    sizes = [_size(column, console, room - pad) for column in table.columns]
    least = [size.minimum + pad for size in sizes]
    telling = _telling(table)
    if sum(least[:telling]) + max(least[telling:], default=0) > room:
        telling = 1
    groups = [list(range(telling))]
    for index in range(telling, len(sizes)):
        if sum(least[i] for i in (*groups[-1], index)) > room and len(groups[-1]) > telling:
            groups.append(list(range(telling)))
        groups[-1].append(index)
    parts = []
    for number, group in enumerate(groups):
        part = copy.copy(table)
        free = max(0, room - sum(least[i] for i in group))
        ideal = sum(sizes[i].span for i in group)
        part.columns = []
        for place, index in enumerate(group):
            width = sizes[index].minimum + (min(free, ideal) * sizes[index].span // ideal if ideal else 0)
            part.columns.append(
                dataclasses.replace(table.columns[index], _index=place, width=width, min_width=None, no_wrap=False)
            )
        part.title = table.title if number == 0 else None
        part.caption = None
        parts.append(part)
    return parts


def _telling(table: Table) -> int:
    """Number of leading columns that make all lines distinct; 1 if all columns together do not."""
    lines = list(zip(*([str(cell) for cell in column.cells] for column in table.columns), strict=True))
    counts = range(1, len(table.columns))
    return next((count for count in counts if len({line[:count] for line in lines}) == len(lines)), 1)


def _size(column: Column, console: Console, most: int) -> Measurement:
    """(least, natural) width of a column: the least cuts no word, or no line if lines are not wrapped.

    The column's greatest width bounds the natural one; only a longer word exceeds it.
    """
    wide = console.options.update(width=_WIDEST)
    widths = [Measurement.get(console, wide, cell) for cell in (column.header, *column.cells)]
    natural = min(max(item.maximum for item in widths), column.max_width or _WIDEST)
    least = natural if column.no_wrap else max(*(item.minimum for item in widths), min(column.min_width or 0, natural))
    return Measurement(min(least, most), min(max(least, natural), most))
