"""Heat map of stability as a table of a page; each colour has a text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from proofroll.core.engine_abilities import by_hand
from proofroll.core.number_format import number
from proofroll.core.verdict import Verdict
from proofroll.report.labels import engine_title, name_of, step
from proofroll.report.pages import slug
from proofroll.studies.failure import NOT_RUN, REFUSED

if TYPE_CHECKING:
    from proofroll.studies.stability.axes import Axis
    from proofroll.studies.stability.records import BoundaryPoint, StabilityStudy

# Steps per natural time beyond which a setting that is right is dear: twice those of a smooth curve.
_MANY = 130


def address(point: BoundaryPoint) -> str:
    """Part of the HTML id of a point that is the same in a map of more points."""
    return slug(f"{point.curve} {point.axis} {point.value:g}")


def cell(point: BoundaryPoint) -> tuple[str, str]:
    """Text of a cell, steps per natural time or the tolerance that are accurate, and the verdict that it looks like."""
    largest = point.largest_accurate
    if point.failure == REFUSED:
        return "⊘", Verdict.REFUSED
    if point.problem:
        return "?", Verdict.NOT_JUDGED
    if largest is None:
        return "–", Verdict.DIFFERS
    if point.resolution != "dt":
        return number(largest), Verdict.AGREES
    steps = point.period / largest
    return f"{float(f'{steps:.2g}'):g}", Verdict.AGREES if steps <= _MANY else Verdict.CONVERGES


@dataclass(frozen=True)
class HeatMap:
    """A heat map as a table.

    Attributes:
        axes: axes with points, each with the values that have points.
        groups: engine -> rows of the table: name of a setting, and in each column its point, or None.
        sentences: engine -> where its settings are right, and how often they are wrong without a warning.
    """

    axes: list[Axis]
    groups: dict[str, list[tuple[str, list[BoundaryPoint | None]]]]
    sentences: dict[str, str]


def heat_map(study: StabilityStudy) -> HeatMap:
    """Heat map as a table, by engine and axis; equations solved for the scene by hand have no row beside engines."""
    shown = [point for point in study.points if not by_hand(point.level)] or study.points
    mapped = [
        replace(axis, values=list(dict.fromkeys(point.value for point in shown if point.axis == axis.name)))
        for axis in study.axes
    ]
    axes = [axis for axis in mapped if axis.values]
    columns = [(axis.name, value) for axis in axes for value in axis.values]
    points = {(point.curve, point.axis, point.value): point for point in shown}
    groups: dict[str, list[tuple[str, list[BoundaryPoint | None]]]] = {}
    for curve, point in {point.curve: point for point in shown}.items():
        name = name_of(point).removeprefix(engine_title(point.engine)).strip(", ") or curve
        groups.setdefault(point.engine, []).append((name, [points.get((curve, *column)) for column in columns]))
    return HeatMap(axes, groups, {engine: _sentence(rows) for engine, rows in groups.items()})


def _sentence(rows: Sequence[tuple[str, Sequence[BoundaryPoint | None]]]) -> str:
    """Sentence on an engine's settings, alike ones together: at how many places they are right, and what they hide."""
    alike: dict[str, list[str]] = {}
    silent, limits = 0, 0
    for name, cells in rows:
        points = [point for point in cells if point is not None and not point.problem]
        right = sum(point.largest_accurate is not None for point in points)
        words = "everywhere" if right == len(points) else f"at {right} of {len(points)} places" if right else "nowhere"
        alike.setdefault(words, []).append(name)
        silent += sum(point.silent for point in points)
        limits += sum(bool(point.failure) for point in points)
    text = "; ".join(f"{', '.join(names)} right {words}" for words, names in alike.items())
    hidden = (
        f"wrong without a warning beyond {silent} of {limits} limits" if silent else "never wrong without a warning"
    )
    return f"{text}; {hidden}."


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
