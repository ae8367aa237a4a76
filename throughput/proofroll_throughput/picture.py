"""Picture of throughput: error of the worst copy against the speed of all copies."""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from proofroll.core.errors import require_known
from proofroll.report.figure import drawn_file
from proofroll.report.styles import engine_colours
from proofroll_throughput.study import Throughput, ThroughputRow

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".svg", ".png", ".pdf")
# Colours by number, lines of the formulations of an engine in turn, and signs of its settings.
_COLOURS = ("#0067b1", "#c8500a", "#00825d", "#b0478a", "#8a6d00", "#3a8fc4", "#5b4bb5", "#6b6b6b")
_LINES, _SIGNS = ("-", "--", ":", "-."), ("o", "s", "D", "^")
_BESIDE = (5, -13)  # places of the numbers of copies above and below their points, for lines in turn [points]
_STYLE = {"font.size": 9, "svg.fonttype": "none"}


def require_picture(path: Path) -> None:
    """Checks before any work that a picture can be drawn and written.

    Raises:
        InputError: the name of the file has no ending of a picture, or its folder cannot be written.
        Missing: a library is not installed.
    """
    from proofroll.cli import options

    require_known("--plot", path.suffix.lower(), ENDINGS, "end the name of the file in one of", path)
    options.require_writable(path, "--plot")
    options.require_pages()


def draw(result: Throughput, path: Path) -> None:
    """Writes the picture of a study. Raises Missing if matplotlib is not installed."""
    from proofroll.files.atomic import replacing

    content = drawn_file(path.suffix.lower().removeprefix("."), _STYLE, lambda: drawn(result), dpi=150)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def title(result: Throughput) -> str:
    """Title of the picture: scene, device and date."""
    devices = ", ".join(sorted({row.device for row in result.rows if row.device}))
    return (
        f"{result.scene}, {result.parameter} {result.values[0]:g} to {result.values[-1]:g}, {result.until:g} s; "
        f"{devices}: {result.machine['processor']}, {result.date}"
    )


def drawn(result: Throughput) -> Figure:
    """Figure with a line for each engine and its settings, and a point with its number for each number of copies."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    axes = figure.add_subplot()
    shown = [row for row in result.rows if row.rate and row.worst]
    colours = engine_colours(dict.fromkeys(row.engine.partition("[")[0] for row in shown))
    lines: dict[str, int] = {}
    for index, (name, group) in enumerate(groupby(shown, key=lambda row: row.name)):
        rows, beside = list(group), _BESIDE[index % len(_BESIDE)]
        engine = rows[0].engine.partition("[")[0]
        number = lines[engine] = lines.get(engine, -1) + 1
        places = [(row.rate or math.nan, row.worst or math.nan) for row in rows]
        axes.plot(
            *zip(*places, strict=True),
            color=_COLOURS[colours[engine] % len(_COLOURS)],
            linestyle=_LINES[number % len(_LINES)],
            marker=_SIGNS[number % len(_SIGNS)],
            markersize=5,
            label=_label(name, rows),
        )
        for row, place in zip(rows, places, strict=True):
            axes.annotate(str(row.copies), place, xytext=(0, beside), textcoords="offset points", ha="center")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(y=0.1)
    axes.set_xlabel("copies × steps in a second of processor time")
    unit = "" if result.unit == "1" else f" [{result.unit}]"
    axes.set_ylabel(f"error of the worst copy in {result.quantity}{unit}")
    axes.grid(alpha=0.25)
    axes.set_title(title(result), fontsize=9)
    if shown:
        axes.legend(fontsize=8)
    return figure


def _label(name: str, rows: list[ThroughputRow]) -> str:
    """Name of a line; of runs one after the other it says so."""
    return f"{name} (one after the other)" if all(row.in_turn for row in rows) else name
