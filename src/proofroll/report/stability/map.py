"""Heat map of stability as a table of a page; each colour has a text."""

from __future__ import annotations

import math
import string
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from proofroll.core.number_format import number
from proofroll.report.labels import engine_title, name_of, step
from proofroll.report.pages import slug
from proofroll.studies.failure import CRASHED, DIVERGED, GAVE_UP, LOST_PHASE, NOT_RUN, REFUSED, TOO_SLOW, WRONG_MODEL

if TYPE_CHECKING:
    from proofroll.studies.stability.axes import Axis
    from proofroll.studies.stability.records import BoundaryPoint, StabilityStudy

# Letters for kinds of failure beyond a boundary, in any scene; "!" is added where the engine was silent.
_LETTERS = {
    DIVERGED: "d",
    LOST_PHASE: "p",
    GAVE_UP: "g",
    CRASHED: "x",
    TOO_SLOW: "t",
    REFUSED: "r",
    WRONG_MODEL: "m",
}
# Steps per natural time with the lightest and the darkest colour; tolerances are coloured by their decades.
_FEWEST, _MOST = 8.0, 1e5
_TOLERANCE_DECADES = 13


def letters(study: StabilityStudy) -> dict[str, str]:
    """Letter of each kind of failure; kinds without a fixed one take the first free letter of their name."""
    letter_of = dict(_LETTERS)
    for kind in study.meanings:
        if kind not in letter_of:
            left = (
                letter
                for letter in kind + string.ascii_letters
                if letter.isalpha() and letter not in letter_of.values()
            )
            letter_of[kind] = next(left, kind)
    return letter_of


def address(point: BoundaryPoint) -> str:
    """Part of the HTML id of a point that is the same in a map of more points."""
    return slug(f"{point.curve} {point.axis} {point.value:g}")


def cell(study: StabilityStudy, point: BoundaryPoint) -> tuple[str, float | None]:
    """Text of a cell and its colour, from 0 (lightest, cheap) to 1 (darkest); None: no colour."""
    largest, failure = point.largest_accurate, point.failure
    beyond = (letters(study).get(failure, failure) + ("!" if point.silent else "")) if failure else ""
    if point.problem:
        return f"? {beyond}".strip(), None
    if largest is None:
        return f"– {beyond}".strip(), None
    if point.resolution != "dt":
        text, shade = number(largest), -math.log10(largest) / _TOLERANCE_DECADES
    else:
        steps = point.period / largest
        text, shade = f"{steps:.0f}", math.log(max(steps, _FEWEST) / _FEWEST) / math.log(_MOST / _FEWEST)
    return f"{text} {beyond}".strip(), min(max(shade, 0.0), 1.0)


@dataclass(frozen=True)
class HeatMap:
    """A heat map as a table.

    Attributes:
        axes: axes with points, each with the values that have points.
        groups: engine -> rows of the table: name of a setting, and in each column the number of its point, or None.
        letters: letters that occur, and the failures that they stand for.
    """

    axes: list[Axis]
    groups: dict[str, list[tuple[str, list[int | None]]]]
    letters: dict[str, str]


def heat_map(study: StabilityStudy) -> HeatMap:
    """Heat map as a table, by engine and axis."""
    mapped = [
        replace(axis, values=list(dict.fromkeys(point.value for point in study.points if point.axis == axis.name)))
        for axis in study.axes
    ]
    axes = [axis for axis in mapped if axis.values]
    columns = [(axis.name, value) for axis in axes for value in axis.values]
    numbers = {(point.curve, point.axis, point.value): number for number, point in enumerate(study.points)}
    groups: dict[str, list[tuple[str, list[int | None]]]] = {}
    for curve, point in {point.curve: point for point in study.points}.items():
        name = name_of(point).removeprefix(engine_title(point.engine)).strip(", ") or curve
        groups.setdefault(point.engine, []).append((name, [numbers.get((curve, *column)) for column in columns]))
    seen = {point.failure for point in study.points}
    return HeatMap(axes, groups, {letter: kind for kind, letter in letters(study).items() if kind in seen})


def reporting(point: BoundaryPoint) -> str:
    """Words for how a failure was reported: before the run, by the engine, or not at all."""
    if point.failure in NOT_RUN:
        return "before the run"
    return "silent" if point.silent else "says so"


def in_words(point: BoundaryPoint) -> str:
    """Full meaning of a cell, in words."""
    words = [f"{name_of(point)} at {point.axis} = {point.value:g}"]
    if point.problem:
        words.append("there is no truth")
    elif point.largest_accurate is None:
        words.append("no affordable step or tolerance holds 1 %")
    else:
        words.append(f"1 % up to {step(point.resolution, point.largest_accurate)}")
    if point.failure:
        words.append(f"beyond: {point.failure}, {reporting(point)}")
    return "; ".join(words)
