"""Stability maps as tables of a page: engine against the values of all axes, colour and text saying the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from proofroll.report.labels import name_of, step, unit
from proofroll.report.stability_map import LETTERS, cell

if TYPE_CHECKING:
    from proofroll.studies.stability_records import BoundaryPoint, StabilityStudy

# From here on a colour is dark enough for light letters.
_DEEP = 0.5


@dataclass(frozen=True)
class HeatAxis:
    """An axis with the values that have a point."""

    name: str
    unit: str
    meaning: str
    values: list[float]


@dataclass(frozen=True)
class HeatCell:
    """A point of the map: what stands in it, how dark it is, and all about it as a title."""

    text: str
    shade: float | None
    deep: bool
    never: bool
    href: str
    title: str


@dataclass(frozen=True)
class HeatLine:
    """A setting: a cell for each value of each axis, None where there is no point."""

    name: str
    cells: list[HeatCell | None]


@dataclass(frozen=True)
class ListedPoint:
    """A point with its id and the name of its setting."""

    id: str
    label: str
    found: BoundaryPoint


@dataclass(frozen=True)
class HeatMap:
    """The map by engine, the letters that occur in it, and the list of its points."""

    axes: list[HeatAxis]
    groups: dict[str, list[HeatLine]]
    letters: dict[str, str]
    points: list[ListedPoint]


def table(study: StabilityStudy, prefix: str) -> HeatMap:
    """The map and the list of its points, whose ids begin with ``prefix``."""
    valued = {
        axis.name: list(dict.fromkeys(p.value for p in study.points if p.axis == axis.name)) for axis in study.axes
    }
    axes = [
        HeatAxis(axis.name, unit(axis.unit), axis.meaning, valued[axis.name])
        for axis in study.axes
        if valued[axis.name]
    ]
    columns = [(axis.name, value) for axis in axes for value in axis.values]
    cells: dict[str, dict[tuple[str, float], HeatCell]] = {}
    for index, point in enumerate(study.points):
        cells.setdefault(point.curve, {})[point.axis, point.value] = _cell(point, f"{prefix}{index}")
    groups: dict[str, list[HeatLine]] = {}
    for point in {point.curve: point for point in study.points}.values():
        rest = name_of(point).removeprefix(point.engine).strip() or point.curve
        line = HeatLine(rest, [cells[point.curve].get(column) for column in columns])
        groups.setdefault(point.engine, []).append(line)
    seen = {point.failure for point in study.points}
    listed = [ListedPoint(f"{prefix}{index}", name_of(point), point) for index, point in enumerate(study.points)]
    return HeatMap(axes, groups, {letter: kind for kind, letter in LETTERS.items() if kind in seen}, listed)


def told(point: BoundaryPoint) -> str:
    """Who was told of a failure: nobody, or before the run, or the engine said so."""
    if point.failure == "refused":
        return "before the run"
    return "silent" if point.silent else "says so"


def _cell(point: BoundaryPoint, href: str) -> HeatCell:
    text, shade = cell(point)
    words = [f"{name_of(point)} at {point.axis} = {point.value:g}"]
    if point.problem:
        words.append("there is no truth")
    elif point.largest_accurate is None:
        words.append("no affordable step or tolerance holds 1 %")
    else:
        words.append(f"1 % up to {step(point.resolution, point.largest_accurate)}")
    if point.failure:
        words.append(f"beyond: {point.failure}, {told(point)}")
    return HeatCell(
        text=text,
        shade=None if shade is None else round(min(max(shade, 0.0), 1.0), 2),
        deep=shade is not None and shade > _DEEP,
        never=point.largest_accurate is None,
        href=href,
        title="; ".join(words),
    )
