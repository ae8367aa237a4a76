"""Tables of ``proofroll run`` on the terminal: values at the end, bounces, matrices of the equations of motion."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any

from proofroll.core.bounces import Bounce
from proofroll.core.number_format import with_bar
from proofroll.core.quantity import powers_of
from proofroll.report.kinds import EquationMatrices

FORCES = ("N", "N m")
_DIGITS, _FEW_DIGITS = 12, 7
_COLUMN = 38  # characters of the widest line that has room beside another
_ROUND_OFF = 1e-14  # of the largest value of a dimension
_BOUNCES = 8  # most bounces on the terminal
_AXES = tuple("xyz")


def value_text(value: float, bar: float | None, size: float, most: int = _DIGITS) -> str:
    """Text of a value in few digits: no digit below its error bar, and 0 for round-off.

    Args:
        value: to be written.
        bar: error bar; None: it is not known.
        size: largest value of the same dimension.
        most: largest number of digits.
    """
    if not math.isfinite(value):
        return "–"
    if abs(value) <= max(bar or 0.0, _ROUND_OFF * size):
        return "0"
    digits = most
    if bar:
        digits = min(most, math.floor(math.log10(abs(value))) - math.ceil(math.log10(bar)) + 1)
    return f"{value:.{max(digits, 1)}g}"


def short_names(names: Sequence[str]) -> list[str]:
    """Names of components and of numbered contacts, written together: ``force.touch.1-4|7.x|y|z``.

    Components (x, y, z) of one name are joined, and numbers before the last part or at the end.
    """
    tails: dict[tuple[str, bool], list[str]] = {}
    for name in names:
        stem, dot, tail = name.rpartition(".")
        joined = bool(dot) and (tail in _AXES or _is_number(tail))
        tails.setdefault((stem if joined else name, joined), []).append(tail)
    numbered: dict[tuple[str, bool, tuple[str, ...]], list[str]] = {}
    for (name, ended), parts in tails.items():
        stem, dot, number = name.rpartition(".")
        joined = bool(dot) and ended and _is_number(number)
        numbered.setdefault((stem if joined else name, joined, tuple(parts) if ended else ()), []).append(number)
    return [
        ".".join([stem, *([_listed(numbers)] if joined else []), *([_listed(parts)] if parts else [])])
        for (stem, joined, parts), numbers in numbered.items()
    ]


def _is_number(text: str) -> bool:
    """True of digits as a counter writes them."""
    return text.isdecimal() and text == str(int(text))


def _listed(parts: Sequence[str]) -> str:
    """Parts of names between bars; three consecutive numbers or more are a range, ``1-4``."""
    runs: list[list[str]] = []
    for part in parts:
        follows = runs and _is_number(part) and _is_number(runs[-1][-1]) and int(part) == int(runs[-1][-1]) + 1
        if follows:
            runs[-1].append(part)
        else:
            runs.append([part])
    return "|".join(f"{run[0]}-{run[-1]}" if len(run) > 2 else "|".join(run) for run in runs)


def value_table(
    values: Mapping[str, float],
    units: Mapping[str, str],
    bars: Mapping[str, float],
    shown: Collection[str],
    *,
    all_digits: bool = True,
    ended: float | None = None,
) -> Any:
    """Table of the last values: positions first, then velocities, energies and residuals, then forces.

    Components and numbered contacts with equal texts are one row, see :func:`short_names`. Short rows without error
    bars stand in two columns.

    Args:
        values: variable -> value.
        units: variable -> unit.
        bars: variable -> error bar, where one is known.
        shown: variables of the table.
        all_digits: False for seven digits of each value.
        ended: time of the values [s] where it is before the end that was asked for; None: it is that end.
    """
    from rich.table import Column, Table

    sizes: dict[frozenset[tuple[str, float]], float] = {}
    for name, value in values.items():
        if math.isfinite(value):
            dimension = _dimension(units[name])
            sizes[dimension] = max(sizes.get(dimension, 0.0 if dimension else 1.0), abs(value))
    most = _DIGITS if all_digits else _FEW_DIGITS
    alike: dict[tuple[str, ...], list[str]] = {}
    for name in sorted(shown, key=lambda item: _place(units[item])):
        value, unit = values[name], units[name]
        bar = bars.get(name) if math.isfinite(value) else None
        size = sizes.get(_dimension(unit), 0.0)
        text, of_bar = (value_text(value, None, size, most), "") if bar is None else with_bar(value, bar)
        family = ".".join(p for p in name.split(".") if not (p.isdigit() or (unit in FORCES and p in _AXES)))
        row = (family, text, unit, *([of_bar] if bars else []))
        alike.setdefault(row, []).append(name)
    rows = [(text, *cells) for (_, *cells), names in alike.items() for text in short_names(names)]
    widths = [max(map(len, column), default=0) for column in zip(*rows, strict=True)]
    if bars or all_digits or ended is not None or sum(widths) + 2 * len(widths) > _COLUMN:
        of_bars = [Column("error bar", justify="right")] if bars else []
        when = "at the end" if ended is None else f"at {ended:.6g} s"
        table = Table(when, Column("value", justify="right"), "unit", *of_bars, box=None, pad_edge=False)
        for row in rows:
            table.add_row(*row)
        return table
    columns = [Column(justify="right" if number in {1, 4} else "left") for number in range(6)]
    table = Table(*columns, box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
    half = (len(rows) + 1) // 2
    for left, right in zip_longest(rows[:half], rows[half:], fillvalue=()):
        table.add_row(*left, *right)
    return table


def bounce_table(bounces: Sequence[Bounce]) -> tuple[Any, str]:
    """Table of the first bounces, and a note on its dashes and its cut, which may be empty.

    Its columns are the time, the energies beside the impact and the height of the next apex, with digits up to their
    error bars. Impacts at one time, as of the corners of a box, are one bounce.
    """
    from rich.table import Column, Table

    heads = ("energy before [J]", "after [J]", "next apex [m above]")
    table = Table("impact at [s]", *(Column(head, justify="right") for head in heads), box=None, pad_edge=False)
    moments = list({item.time: item for item in reversed(bounces)}.values())[::-1]
    energy = max((abs(item.energy_before) for item in moments if math.isfinite(item.energy_before)), default=0.0)
    height = max((abs(item.height) for item in moments if math.isfinite(item.height)), default=0.0)
    for item in moments[:_BOUNCES]:
        energies = (value_text(value, item.energy_bar, energy) for value in (item.energy_before, item.energy_after))
        table.add_row(f"{item.time:.9g}", *energies, value_text(item.height, item.height_bar, height))
    notes = ["–: no apex before the next impact or the end"] * any(math.isnan(b.height) for b in moments[:_BOUNCES])
    if len(moments) > _BOUNCES:
        notes.append(f"{len(moments) - _BOUNCES} more bounces: --events FILE.csv")
    return table, "; ".join(notes)


def _dimension(unit: str) -> frozenset[tuple[str, float]]:
    """Powers of base units; equal for a moment and an energy."""
    return frozenset(powers_of(unit).items())


def _place(unit: str) -> int:
    """Place of a variable in the table by its unit: places and angles, velocities, the rest, forces and moments."""
    order = {"s": 0, "m": 1, "rad": 1, "m/s": 2, "rad/s": 2}
    return 4 if unit in FORCES else order.get(unit, 3)


def matrix_lines(content: EquationMatrices) -> Iterator[Any]:
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
