"""Heat maps of stability as a picture and as a table of a page; each colour has a text."""

from __future__ import annotations

import itertools
import math
import string
import textwrap
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from proofroll.core.number_format import counted, number
from proofroll.report.figure import panels, svg_text
from proofroll.report.labels import engine_title, name_of, step
from proofroll.report.pages import slug
from proofroll.studies.failure import CRASHED, DIVERGED, GAVE_UP, LOST_PHASE, NOT_RUN, REFUSED, TOO_SLOW, WRONG_MODEL

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
# Number of letters of the legend on a line above one panel.
_LETTERS_PER_PANEL = 118


def svg(study: StabilityStudy) -> str:
    """Heat maps as one SVG text; letters stay text, which a page can scale, search and read aloud.

    Raises:
        Missing: matplotlib is not installed.
    """
    return svg_text({"svg.fonttype": "none", "font.size": 8.0}, lambda: _drawn(study))


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


def legend(study: StabilityStudy) -> list[str]:
    """Legend of the cells, as sentences."""
    kinds = ", ".join(f"{letter} {kind}" for kind, letter in letters(study).items())
    sizes = f"{counted(len(study.points), 'points')}, {counted(study.boundaries, 'boundaries')}"
    return [
        f"{study.scene}: {sizes}, {study.silent} silent.",
        "Steps per natural time (or tolerance) that 1 % of the range needs; – no affordable one does; ? no truth.",
        f"Letter: what is beyond the boundary of stability, or else of 1 % ({kinds}); ! the engine did not say so.",
    ]


def _drawn(study: StabilityStudy) -> Figure:
    """Figure with a panel for each axis that has points, row by row."""
    import matplotlib as mpl

    axes = [axis for axis in study.axes if any(point.axis == axis.name for point in study.points)]
    curves = list(dict.fromkeys(point.curve for point in study.points))
    figure, drawn, rows, columns = panels(len(axes))
    figure.set_size_inches(7.2 * columns, rows * (0.9 + 0.24 * len(curves)) + 1.0)
    for panel, axis in zip(drawn, axes, strict=True):
        _panel(panel, study, axis, curves, mpl.colormaps["cividis_r"])
    text = "\n".join(textwrap.fill(sentence, _LETTERS_PER_PANEL * columns) for sentence in legend(study))
    figure.suptitle(text, fontsize=8, x=0.01, ha="left")
    return figure


def _panel(panel: Any, study: StabilityStudy, axis: Axis, curves: list[str], colours: Any) -> None:
    points = [point for point in study.points if point.axis == axis.name]
    values = list(dict.fromkeys(point.value for point in points))
    names = curve_names(study)
    for point in points:
        x, y = values.index(point.value), curves.index(point.curve)
        text, shade = cell(study, point)
        face = "#ffffff" if shade is None else colours(shade)
        hatch = "////" if text.startswith("–") else None
        panel.add_patch(_rectangle(x, y, face, hatch))
        dark = shade is not None and shade > 0.5
        behind = {"facecolor": "white", "edgecolor": "none", "pad": 1.0} if hatch else None
        colour = "white" if dark else "black"
        panel.text(x, y, text, ha="center", va="center", fontsize="small", color=colour, bbox=behind)
    panel.set(
        xlim=(-0.5, len(values) - 0.5),
        ylim=(len(curves) - 0.5, -0.5),
        xlabel=f"{axis.name}" + (f" [{axis.unit}]" if axis.unit != "1" else ""),
    )
    panel.set_xticks(range(len(values)), [f"{value:g}" for value in values])
    panel.set_yticks(range(len(curves)), [names[curve] for curve in curves])
    panel.tick_params(length=0)
    engines = [curve.partition("[")[0] for curve in curves]
    for row, (upper, lower) in enumerate(itertools.pairwise(engines)):
        if upper != lower:
            panel.axhline(row + 0.5, color="0.2", lw=1.0)


def curve_names(study: StabilityStudy) -> dict[str, str]:
    """Engine, formulation and setting of each curve, for readers."""
    return {point.curve: name_of(point) for point in study.points}


def _rectangle(x: int, y: int, face: Any, hatch: str | None) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=face, hatch=hatch, edgecolor="0.8", lw=0.5)


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
        name = name_of(point).removeprefix(engine_title(point.engine)).strip() or curve
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
