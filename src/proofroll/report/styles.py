"""Style of a row in all figures of a comparison: colour with dashes, width and symbol."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from proofroll.core.entry_points import announced
from proofroll.core.plugins import GROUP
from proofroll.report.comparison.records import ReportedRow

DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
COLOURS = 8
# Symbols by name, each with its outline around (0, 0) as an SVG path.
OUTLINES = {
    "circle": "M-3.4 0a3.4 3.4 0 1 0 6.8 0a3.4 3.4 0 1 0 -6.8 0Z",
    "square": "M-3 -3H3V3H-3Z",
    "diamond": "M0 -4.2L4.2 0L0 4.2L-4.2 0Z",
    "triangle-up": "M0 -3.8L3.8 2.8H-3.8Z",
    "triangle-down": "M0 3.8L3.8 -2.8H-3.8Z",
    "cross": "M-1.3 -3.8H1.3V-1.3H3.8V1.3H1.3V3.8H-1.3V1.3H-3.8V-1.3H-1.3Z",
    "x": "M-3.6 -1.8L-1.8 -3.6L0 -1.8L1.8 -3.6L3.6 -1.8L1.8 0L3.6 1.8L1.8 3.6L0 1.8L-1.8 3.6L-3.6 1.8L-1.8 0Z",
    "triangle-left": "M-3.8 0L2.8 -3.8V3.8Z",
    "triangle-right": "M3.8 0L-2.8 -3.8V3.8Z",
    "bowtie": "M-3.8 -3.4L3.8 3.4V-3.4L-3.8 3.4Z",
    "hourglass": "M-3.4 -3.8H3.4L-3.4 3.8H3.4Z",
    "star": "M0 -4.4L1.1 -1.4L4.2 -1.4L1.7 .5L2.6 3.6L0 1.7L-2.6 3.6L-1.7 .5L-4.2 -1.4L-1.1 -1.4Z",
}


@dataclass(frozen=True)
class Style:
    """Style of a row: number of the colour, dashes and symbol by name, width of the line [px], and opacity."""

    colour: int
    dash: str
    width: float
    symbol: str
    opacity: float


def engine_colours(engines: Iterable[str] = ()) -> dict[str, int]:
    """Number of the colour of each engine, the same in every report of an installation.

    Engines that proofroll brings come first, then those of other packages.

    Args:
        engines: further ones, as of other interpreters, in the order of the page.
    """
    points = sorted(announced(GROUP), key=lambda point: (not point.value.startswith("proofroll."), point.name))
    names = dict.fromkeys([*(point.name for point in points), *engines])
    return {name: number % COLOURS for number, name in enumerate(names)}


def styles(rows: Sequence[ReportedRow], page_engines: Sequence[str] = ()) -> list[Style]:
    """Style of each row: colour by engine, dashes by formulation, width by preset, symbol by number in the engine.

    Args:
        rows: of a comparison.
        page_engines: engines of the page in its order.
    """
    colours = engine_colours([*page_engines, *(row.name for row in rows)])
    formulations = {name: list(dict.fromkeys(r.formulation for r in rows if r.name == name)) for name in colours}
    widths = {"default": 1.1, "tuned": 2.4}
    names = list(OUTLINES)
    seen: dict[str, int] = {}
    looks = []
    for row in rows:
        place = seen[row.name] = seen.get(row.name, -1) + 1
        looks.append(
            Style(
                colour=colours[row.name],
                dash=DASHES[formulations[row.name].index(row.formulation) % len(DASHES)],
                width=widths.get(row.preset or "", 1.7),
                symbol=names[place % len(names)] + ("-open" if place // len(names) % 2 else ""),
                opacity=0.5 if row.verdict in {"differs", "failed"} else 1,  # so that they do not hide rows that agree
            )
        )
    return looks
