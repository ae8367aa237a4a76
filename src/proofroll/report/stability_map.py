"""The heat maps: engine against the value of an axis, with colour and text that says the same."""

from __future__ import annotations

import itertools
import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.report.figure import svg_text
from proofroll.report.labels import name_of, number
from proofroll.running.store import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from proofroll.studies.axes import Axis
    from proofroll.studies.stability_records import BoundaryPoint, StabilityStudy

# Letters for what is beyond the boundary; with "!" where the engine was silent.
LETTERS = {
    "diverged": "d",
    "energy gain": "e",
    "left the surface": "l",
    "sank in": "s",
    "creep": "c",
    "reversed": "v",
    "lost phase": "p",
    "solver gave up": "g",
    "crashed": "x",
    "too slow": "t",
    "refused": "r",
}
# Steps per natural time at which a colour is darkest and lightest; tolerances are put between by their decades.
_FEWEST, _MOST = 8.0, 1e5
_TOLERANCE_DECADES = 13
# As many letters of the legend stand above a panel.
_LETTERS_PER_PANEL = 118


def draw(study: StabilityStudy, path: Path) -> None:
    """Writes the heat maps as one SVG file, a panel per axis.

    Raises:
        Missing: matplotlib is not installed.
    """
    write_text(path, svg(study))


def svg(study: StabilityStudy) -> str:
    """All heat maps as one SVG text; texts stay texts, which a page can scale, search and read out.

    Raises:
        Missing: matplotlib is not installed.
    """
    return svg_text({"svg.fonttype": "none", "font.size": 8.0}, lambda: _drawn(study))


def legend(study: StabilityStudy) -> list[str]:
    """What the cells say, as sentences."""
    kinds = ", ".join(f"{letter} {kind}" for kind, letter in LETTERS.items())
    return [
        f"{study.scene}: {len(study.points)} points, {study.boundaries} boundaries, {study.silent} silent.",
        "Steps per natural time (or tolerance) that 1 % of the range needs; – no affordable one does; ? no truth.",
        f"Letter: what is beyond the boundary of stability, or else of 1 % ({kinds}); ! the engine did not say so.",
    ]


def _drawn(study: StabilityStudy) -> Figure:
    """A panel for each axis that has points, row by row."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    axes = [axis for axis in study.axes if any(point.axis == axis.name for point in study.points)]
    columns = min(2, len(axes)) or 1
    rows = math.ceil(len(axes) / columns) or 1
    curves = list(dict.fromkeys(point.curve for point in study.points))
    figure = Figure(figsize=(7.2 * columns, rows * (0.9 + 0.24 * len(curves)) + 1.0), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel, axis in zip(panels, axes, strict=False):
        _panel(panel, study, axis, curves, mpl.colormaps["cividis_r"])
    for panel in panels[len(axes) :]:
        panel.set_visible(False)
    text = "\n".join(textwrap.fill(sentence, _LETTERS_PER_PANEL * columns) for sentence in legend(study))
    figure.suptitle(text, fontsize=8, x=0.01, ha="left")
    return figure


def _panel(panel: Any, study: StabilityStudy, axis: Axis, curves: list[str], colours: Any) -> None:
    points = [point for point in study.points if point.axis == axis.name]
    values = list(dict.fromkeys(point.value for point in points))
    names = {point.curve: name_of(point) for point in study.points}
    for point in points:
        x, y = values.index(point.value), curves.index(point.curve)
        text, shade = cell(point)
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
    for row, (one, other) in enumerate(itertools.pairwise(engines)):
        if one != other:
            panel.axhline(row + 0.5, color="0.2", lw=1.0)


def _rectangle(x: int, y: int, face: Any, hatch: str | None) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=face, hatch=hatch, edgecolor="0.8", lw=0.5)


def cell(point: BoundaryPoint) -> tuple[str, float | None]:
    """Text of a cell and its place between the lightest (0, cheap) and the darkest colour; None: no colour."""
    largest, failure = point.largest_accurate, point.failure
    beyond = (LETTERS.get(failure, failure) + ("!" if point.silent else "")) if failure else ""
    if point.problem:
        return f"? {beyond}".strip(), None
    if largest is None:
        return f"– {beyond}".strip(), None
    if point.resolution != "dt":
        shade = -math.log10(largest) / _TOLERANCE_DECADES
        return f"{number(largest)} {beyond}".strip(), shade
    steps = point.period / largest
    shade = math.log(max(steps, _FEWEST) / _FEWEST) / math.log(_MOST / _FEWEST)
    return f"{steps:.0f} {beyond}".strip(), min(shade, 1.0)
