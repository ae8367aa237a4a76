"""Draws one figure of a file from its runs."""

from __future__ import annotations

import string
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.errors import InputError
from proofroll.core.events import events_of
from proofroll.papers.blajer_2006.figures import style
from proofroll.papers.blajer_2006.figures.definition import Figure, Panel
from proofroll.papers.blajer_2006.figures.quantities import TIME
from proofroll.papers.blajer_2006.figures.study import FigureRun, FigureRuns
from proofroll.report.figure import drawn_file, styled
from proofroll.report.pages import element

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawn

# Number of marks of the truth over the panels of a row: enough to compare, few enough to see the curves.
_TRUTH_MARKS = 66
# A curve that varies by less than this part of its size counts as constant, and its axis spans ± the second part.
_CONSTANT, _ROOM = 1e-3, 0.05


def picture(definition: Figure, study: FigureRuns, form: str) -> bytes:
    """A figure with panels as the content of a file: ``svg``, ``png`` or ``pdf``.

    Raises:
        InputError: a text of the figure has mathematics that matplotlib cannot draw.
        Missing: matplotlib is not installed.
    """
    with styled(style.SETTINGS):
        made = drawn(definition, study)
    metadata = {"Title": definition.name, "Subject" if form == "pdf" else "Description": definition.caption}
    try:
        return drawn_file(form, style.SETTINGS, lambda: made, style.PIXELS_PER_INCH, metadata)
    except ValueError as error:  # mathematics is read only when it is drawn
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"figure {definition.name}", "text", f"its text cannot be drawn: {reason}") from None


def inline(definition: Figure, study: FigureRuns, prefix: str) -> str:
    """SVG element of a figure with panels for a page; its ids begin with ``prefix``."""
    return element(picture(definition, study, "svg").decode(), prefix)


def drawn(definition: Figure, study: FigureRuns) -> Drawn:
    """The matplotlib figure of a figure with panels, in the current style (see :func:`styled`)."""
    from matplotlib.figure import Figure as New

    rows, columns = -(-len(definition.panels) // definition.columns), definition.columns
    figure = New(figsize=(style.WIDTH, 0.35 + rows * definition.height), layout="constrained")
    shared: dict[str, Axes] = {}
    placed: list[Axes] = []
    for number, panel in enumerate(definition.panels):
        axes = figure.add_subplot(rows, columns, number + 1, sharey=shared.get(panel.share))
        if panel.share:
            shared.setdefault(panel.share, axes)
        placed.append(axes)
        _panel(axes, panel, definition, study)
        axes.set_xlabel(style.axis_label(_symbol(panel.x, study), study.units[panel.x]))
        axes.set_ylabel(_ordinate(panel, study))
        letter = f"({string.ascii_lowercase[number % 26]})" if len(definition.panels) > 1 else ""
        named = panel.events and number == 0
        title = " ".join(filter(None, (letter, panel.title)))
        axes.set_title(title, loc="left", pad=_pad(panel, named))
        if panel.events:
            _events(axes, study.runs[panel.runs[0]], definition, named=named)
    for axes, panel in zip(placed, definition.panels, strict=True):
        if panel.zero and axes.lines:  # once every panel is drawn that shares the range: a limit ends the automatic one
            axes.set_ylim(bottom=0)
    _legend(figure, definition, study)
    return figure


def _pad(panel: Panel, named: bool) -> float:
    """Distance of the title from the axes [points], with room for the names of events or for a legend."""
    if named:
        return 22
    return 16 if len(panel.runs) > 1 and not panel.events else 4


def _panel(axes: Axes, panel: Panel, definition: Figure, study: FigureRuns) -> None:
    number = 0
    until = definition.until or study.figures.until
    for run in panel.runs:
        for name in panel.y:
            label = _label(panel, run, name, study)
            curve = _curve(study.runs[run], panel.x, name, until)
            look = style.LINES[number % len(style.LINES)]
            number += 1
            if curve is None:
                continue
            axes.plot(*curve, label=label, zorder=2 + 0.01 * number, **look)
            if panel.truth and study.truths is not study.runs:
                marks = _curve(study.truths[run], panel.x, name, until)
                if marks is not None:
                    count = min(_TRUTH_MARKS // (definition.columns + 1), len(marks[0]))
                    marked = np.linspace(0, len(marks[0]) - 1, count).round().astype(int)
                    axes.plot(marks[0][marked], marks[1][marked], zorder=3, **style.TRUTH)
    for level in panel.levels:
        axes.axhline(level.value, zorder=1.5, **style.LEVEL)
        axes.annotate(
            level.label, (1, level.value), (3, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
            ha="left", va="center", fontsize=8, color="0.25", annotation_clip=False,
        )  # fmt: skip
    if not axes.lines:
        axes.text(0.5, 0.5, f"{study.engine} cannot say", transform=axes.transAxes, ha="center", va="center")
        return
    _limits(axes, panel, until)
    if number > 1:
        _key(axes, panel, number)


def _limits(axes: Axes, panel: Panel, until: float) -> None:
    if panel.x == TIME:
        axes.set_xlim(0, until)
    drawn = np.concatenate([np.asarray(line.get_ydata(), dtype=np.float64) for line in axes.lines])
    size = float(np.max(np.abs(drawn)))
    if np.ptp(drawn) < _CONSTANT * size:
        middle = float(np.mean(drawn))
        axes.set_ylim(middle - _ROOM * size, middle + _ROOM * size)
    if panel.equal:
        axes.set_aspect("equal", adjustable="box")
        axes.margins(0.08)


def _key(axes: Axes, panel: Panel, curves: int) -> None:
    """Draws the legend above the axes, or inside where events are named above."""
    if panel.events:
        axes.legend(loc="upper left" if panel.levels else "lower left")
        return
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=curves, borderaxespad=0.1, columnspacing=1.0,
        handletextpad=0.4, borderpad=0.1,
    )  # fmt: skip


def _ordinate(panel: Panel, study: FigureRuns) -> str:
    symbols = ", ".join(dict.fromkeys(_symbol(name, study) for name in panel.y))
    return style.axis_label(panel.label or symbols, study.units[panel.y[0]])


def _curve(made: FigureRun, x: str, y: str, until: float) -> tuple[Any, Any] | None:
    across, up = made.curve(x, until), made.curve(y, until)
    return None if across is None or up is None else (across, up)


def _label(panel: Panel, run: str, name: str, study: FigureRuns) -> str:
    parts = [_symbol(name, study)] if len(panel.y) > 1 else []
    if len(panel.runs) > 1:
        parts.append(study.figures.runs[run].label)
    return ", ".join(parts)


def _symbol(name: str, study: FigureRuns) -> str:
    symbol = study.figures.symbols.get(name)
    return f"${symbol}$" if symbol else name.replace("_", " ")


def _events(axes: Axes, made: FigureRun, definition: Figure, *, named: bool) -> None:
    """Shades times of slip and marks each event; ``named``: with its kind and time above the axes."""
    if made.dataset is None:
        return
    end = min(definition.until or np.inf, float(made.dataset[TIME][-1]))
    events = [event for event in events_of(made.dataset) if event.time <= end]
    for number, event in enumerate(events):
        axes.axvline(event.time, zorder=1, **style.EVENT)
        if event.kind == "slip":
            until = events[number + 1].time if number + 1 < len(events) else end
            axes.axvspan(event.time, until, zorder=0, **style.SLIPPING)
        if named:
            axes.annotate(
                f"{event.kind}s\n{event.time:.3f} s", (event.time, 1), (0, 2), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="center", va="bottom", fontsize=8,
            )  # fmt: skip


def _legend(figure: Drawn, definition: Figure, study: FigureRuns) -> None:
    """Adds a legend for lines and marks below the figure."""
    from matplotlib.lines import Line2D

    marked = any(panel.truth for panel in definition.panels) and study.truths is not study.runs
    handles = [Line2D([], [], color="0.2", label=study.engine)]
    if marked:
        handles.append(Line2D([], [], label="truth (some samples)", **style.TRUTH))
    figure.legend(handles=handles, loc="outside lower right", ncols=2)
