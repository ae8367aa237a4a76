"""Work–precision diagram: error against cost, with the Pareto front and the truth's error bar."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from proofroll.report.figure import panels, svg_text
from proofroll.report.labels import listed, name_of, symbol
from proofroll.report.labels import unit as shown_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from proofroll.studies.tradeoff.records import MeasuredPoint, TradeoffStudy

# One colour per engine, one dash and marker per formulation: curves are distinct without colour, too.
_COLOURS = ("#3b6fb6", "#c9622f", "#3f8f5b", "#8b5fa8", "#b08a1e", "#5b6770", "#b8476b", "#2a8f9c")
_DASHES = ("-", "--", "-.", ":")
_MARKERS = "osD^vPX*"
# Smaller errors are round-off of any double; a logarithm needs a positive number.
SMALLEST = 1e-17
# Height of a line of the legend [in].
_LINE = 0.145


def svg(study: TradeoffStudy, quantities: Sequence[str]) -> str:
    """Diagram as SVG text, one panel per quantity. Raises Missing if matplotlib is not installed."""
    return svg_text({"font.size": 9}, lambda: _drawn(study, quantities))


def _drawn(study: TradeoffStudy, quantities: Sequence[str]) -> Figure:
    figure, drawn, rows, columns = panels(len(quantities))
    curves = {point.curve for point in study.points}
    figure.set_size_inches(5.2 * columns + 2.6, max(3.9 * rows + 0.4, _LINE * len(curves) + 1.0))
    for panel, quantity in zip(drawn, quantities, strict=True):
        _panel(panel, study, quantity)
    parameters = listed(study.parameters) or "default parameters"
    figure.suptitle(f"{study.scene}, {parameters}, over {study.until:g} s", fontsize=9)
    handles, labels = drawn[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", frameon=False, fontsize=7)
    return figure


def _panel(panel: Any, study: TradeoffStudy, quantity: str) -> None:
    facts = study.quantities[quantity]
    curves: dict[str, list[MeasuredPoint]] = {}
    for point in study.points:
        if point.seconds_per_second is not None and point.error.get(quantity) is not None:
            curves.setdefault(point.curve, []).append(point)
    engines = list(dict.fromkeys(point.engine for point in study.points))
    seen: dict[str, list[str]] = {}
    for points in curves.values():
        engine, formulation = points[0].engine, str(points[0].settings.get("formulation", ""))
        preset = str(points[0].settings.get("preset", ""))
        styles = seen.setdefault(engine, [])
        if formulation not in styles:
            styles.append(formulation)
        index = styles.index(formulation)
        panel.plot(
            [point.seconds_per_second for point in points],
            [max(point.error[quantity] or 0.0, SMALLEST) for point in points],
            color=_COLOURS[engines.index(engine) % len(_COLOURS)],
            linestyle=_DASHES[index % len(_DASHES)],
            marker=_MARKERS[index % len(_MARKERS)],
            markersize=3,
            markerfacecolor="none" if preset == "default" else None,
            linewidth=1.6 if preset == "tuned" else 1.0,
            alpha=0.9,
            label=name_of(points[0]),
        )
    panel.set(xscale="log", yscale="log")
    _front(panel, study, quantity)
    bar = facts.truth_error_bar
    if bar:
        panel.axhspan(SMALLEST, bar, color="0.88", lw=0, zorder=0)
    cost = study.truth.seconds_per_second
    if cost and bar:
        panel.plot([cost], [bar], marker="*", color="black", markersize=9, linestyle="", label="truth: its error bar")
    unit = shown_unit(facts.unit)
    panel.set(
        xlabel="cost through this adapter [wall seconds per simulated second]",
        ylabel=f"largest error of {symbol(quantity)}" + (f" [{unit}]" if unit else ""),
    )
    panel.grid(which="major", color="0.9", lw=0.6)


def _front(panel: Any, study: TradeoffStudy, quantity: str) -> None:
    """Draws Pareto fronts as steps, of the engines and of everything."""
    floor = max(study.quantities[quantity].truth_error_bar or 0.0, SMALLEST)
    right = max((p.seconds_per_second for p in study.points if p.seconds_per_second), default=1.0)
    for key, colour, words in (
        ("pareto_engines", "black", "Pareto front of the engines"),
        ("pareto", "#8f9aa3", "with the scene's own equations"),
    ):
        chosen = study.front(key, quantity)
        if not chosen or (key == "pareto" and chosen == study.front("pareto_engines", quantity)):
            continue  # there are no equations of the scene's own, or none that is better
        costs = [point.seconds_per_second for point in chosen]
        errors = [max(point.envelope_of(quantity), floor) for point in chosen]
        panel.step(
            [costs[0], *costs, right],
            [panel.get_ylim()[1], *errors, errors[-1]],
            where="post",
            color=colour,
            lw=3,
            alpha=0.3,
            zorder=0.5,
            label=words,
        )
