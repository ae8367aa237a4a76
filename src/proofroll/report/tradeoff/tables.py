"""Texts of a trade-off and of a recommendation: for the terminal within 100 columns, and sentences for the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.comparison import Tolerance
from proofroll.core.engine_abilities import by_hand
from proofroll.core.number_format import error, number
from proofroll.report.labels import engine_words, listed, name_of, speed, step
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll.running.timing import CONFIDENCE
from proofroll.studies.tradeoff.requirements import Requirements, holding

if TYPE_CHECKING:
    from proofroll.studies.tradeoff.records import Corner, MeasuredPoint, TradeoffStudy

FIRST_TOLERANCE = 1e-4  # part of a quantity's size at which the terminal names a setting
_TOLERANCES = (1e-3, 1e-4, 1e-6, 1e-8)  # parts of a quantity's size, with a column each
_SCATTER = 2.0  # ratio of the ends of a cost's interval beyond which it is unknown
_MOST_COLUMNS = 4  # largest number of quantities that are shown by default


def default_quantities(study: TradeoffStudy) -> list[str]:
    """Quantities shown by default: the deciding one, and columns that the scene's elements declare; at most four.

    A column is left out if every run has it exactly, as forces of bearings that carry nothing: it chooses no engine.
    """
    decides = [study.quantity] if study.quantity in study.quantities else []  # an order of events has no curve
    told = {name: {point.error.get(name) for point in study.points} - {None} for name in study.quantities}
    beside = (name for name, item in study.quantities.items() if item.column and told[name] != {0.0})
    return list(dict.fromkeys([*decides, *beside]))[:_MOST_COLUMNS]


def cost_of(point: MeasuredPoint) -> str:
    """Text of a cost: seconds per second, and the larger half width of its interval.

    Fewer than six values have no interval of 95 %, so that their own confidence is added.
    """
    cost = point.seconds_per_second
    if cost is None:
        return "–"
    confidence = point.confidence
    if point.interval is None or not confidence:
        return f"{number(cost)} (once)"
    spread = max(point.interval[1] - cost, cost - point.interval[0]) / cost
    return f"{number(cost)} ±{100 * spread:.0f}%" + (f" ({100 * confidence:.2g}%)" if confidence < CONFIDENCE else "")


def effort(study: TradeoffStudy) -> str:
    """Sentences on the accuracy of speeds, and on the range of parameters in which the choices hold."""
    text = ""
    if study.brief:
        text = (
            "Speeds were measured briefly, twice at most and those of long runs once, and the finest steps were "
            "left out: they contradict no claim. "
        )
    range_words = f"at {listed(study.parameters) or 'the default parameters'} over {study.until:g} s"
    if study.over:
        return (
            f"{text}Every choice holds {range_words}, and at the corners of {_ranges(study)}; nothing is known beyond."
        )
    return f"{text}Every choice holds {range_words}; it was not checked over ranges of the parameters."


def cheapest_held(study: TradeoffStudy) -> tuple[list[MeasuredPoint], int]:
    """Cheapest point of each engine's setting that holds ``FIRST_TOLERANCE``, the cheapest first; the others' number.

    Equations that are solved for the scene by hand are left out.
    """
    scale = study.quantities[study.quantity].scale if study.quantity in study.quantities else None
    points = [point for point in study.points if not by_hand(point.level)]
    timed = sorted((x for x in points if x.seconds_per_second), key=lambda x: x.seconds_per_second or 0.0, reverse=True)
    held = [x for x in timed if scale is not None and x.envelope_of(study.quantity) <= FIRST_TOLERANCE * scale]
    cheapest = [*{point.curve: point for point in held}.values()]
    cheapest.sort(key=lambda point: point.seconds_per_second or 0.0)
    return cheapest, len({point.curve for point in points}) - len(cheapest)


def _ranges(study: TradeoffStudy) -> str:
    return ", ".join(f"{name} {min(values):g} to {max(values):g}" for name, values in study.over.items())


def tradeoff_parts(study: TradeoffStudy, shown: Sequence[str], *, every_point: bool) -> Iterator[Table | str]:
    """Parts of a trade-off's text: what to take, speeds at some tolerances, and counts; or all its points.

    Args:
        study: the measured trade-off.
        shown: quantities with a column; all else is about the first of them.
        every_point: True to list all points, corners, and the makeup of errors.
    """
    cheapest = _held(study, shown[0]) if study.quantities[shown[0]].scale else {}
    yield from _lead(cheapest, shown[0])
    if cheapest:
        yield from ("", *_held_lines(cheapest))
    if every_point:
        yield from ("", point_table(study, study.points, shown, "Every point"))
        if study.over:
            yield from ("", corner_table(study, shown[0]))
        yield ""
        yield from (f"{item.curve}: {item.sentence}" for item in study.budgets if item.quantity == shown[0])
        yield from study.findings[:-1]
    yield from ("", effort(study), *study.findings[-1:])
    yield from (f"{name}: {reason}" for name, reason in study.absent.items())
    yield from (f"?? {line}" for line in study.claims.undecided)
    yield from (f"!! {line}" for line in study.claims.contradictions)


def _held(study: TradeoffStudy, quantity: str) -> dict[str, dict[float, MeasuredPoint]]:
    """Engine with formulation -> tolerance, a part of the quantity's size -> its cheapest point that holds it.

    The formulations are in the order of their cost at ``FIRST_TOLERANCE``; those that hold nothing are left out.
    """
    cheapest: dict[str, dict[float, MeasuredPoint]] = {}
    for tolerance in (FIRST_TOLERANCE, *_TOLERANCES):
        for point in holding(study, Requirements(quantity, Tolerance(tolerance, True))):
            name = engine_words(point.engine, point.settings.get("formulation"))
            if point.seconds_per_second is not None:
                cheapest.setdefault(name, {}).setdefault(tolerance, point)
    return cheapest


def _lead(cheapest: Mapping[str, Mapping[float, MeasuredPoint]], quantity: str) -> Iterator[str]:
    """Sentences: what to take at ``FIRST_TOLERANCE``, whether it leads at every tolerance, and what is next."""
    at_first = [(name, points[FIRST_TOLERANCE]) for name, points in cheapest.items() if FIRST_TOLERANCE in points]
    asked = f"{number(FIRST_TOLERANCE)} of the size of {quantity}"
    if not at_first:
        yield f"Nothing that was measured holds {asked}."
        return
    (name, best), *others = at_first
    least = {size: min(x[size].cost for x in cheapest.values() if size in x) for size in cheapest[name]}
    leads = all(cheapest[name][size].cost <= cost for size, cost in least.items())
    everywhere = " It leads wherever it holds" if leads else " Others lead at other tolerances"
    second = f"; next is {others[0][0]}: {_speed_of(others[0][1])}" if others else ""
    yield f"Take {point_words(best)}: {_speed_of(best)} at {asked}.{everywhere}{second}."


def _held_lines(cheapest: Mapping[str, Mapping[float, MeasuredPoint]]) -> Iterator[str]:
    """A line for each engine with its formulation: speed of its cheapest point at each tolerance."""
    yield f"{'× real time, cheapest that holds':36}" + "".join(f"{number(size):>9}" for size in _TOLERANCES)
    unknown = False
    for name, points in cheapest.items():
        cells = [_cell(points[size]) if size in points else "–" for size in _TOLERANCES]
        yield f"{name:36}" + "".join(f"{cell:>9}" for cell in cells)
        unknown = unknown or "?" in cells
    if unknown:
        yield f"?: unknown, its timings differ by more than a factor of {_SCATTER:g}."


def point_words(point: MeasuredPoint) -> str:
    """Engine, formulation, setting and step of a point for a reader."""
    return ", ".join(filter(None, (name_of(point), step(point.resolution, point.step))))


def _scatter(point: MeasuredPoint) -> float:
    """Ratio of the ends of the interval of a point's cost; 1 without an interval."""
    return point.interval[1] / point.interval[0] if point.interval and point.interval[0] > 0 else 1.0


def _cell(point: MeasuredPoint) -> str:
    """Speed of a point, rough if it was timed once; ``?`` if its timings scatter too much."""
    if _scatter(point) > _SCATTER:
        return "?"
    return speed(point.cost, bool(point.interval and point.confidence))


def _speed_of(point: MeasuredPoint) -> str:
    """The same in a sentence."""
    if point.seconds_per_second is None:
        return "not timed"
    if _scatter(point) > _SCATTER:
        return f"speed unknown (its timings differ by a factor of {number(_scatter(point))})"
    return f"{_cell(point)} real time"


def point_table(study: TradeoffStudy, points: Sequence[MeasuredPoint], quantities: Sequence[str], title: str) -> Table:
    """Table of points, one line each: cost, and error in each quantity."""
    errors = numeric(*(f"{study.quantities[name].symbol} [{study.quantities[name].unit}]" for name in quantities))
    table = plain_table(*unbroken("engine formulation setting", "step", "cost s/s"), *errors, title=title)
    table.caption = Text("cost: wall seconds per simulated second through this adapter")
    for point in points:
        shown = [error(point.error.get(name)) if name in point.error else "–" for name in quantities]
        if point.status != "done":
            shown = [str(point.status), *[""] * (len(quantities) - 1)]
        table.add_row(Text(name_of(point)), step(point.resolution, point.step), cost_of(point), *shown)
    return table


def corner_table(study: TradeoffStudy, quantity: str) -> Table:
    """Table of points that were run over ranges of parameters: error at the defaults, and worst at the corners."""
    title = f"Over {_ranges(study)}: error of {quantity} [{study.quantities[quantity].unit}]"
    columns = [*unbroken("engine formulation setting", "step"), *numeric("here", "worst"), Column("where")]
    table = plain_table(*columns, title=title)
    checked = [p for p in study.points if p.corners and quantity in p.error]
    for point in sorted(checked, key=lambda p: p.seconds_per_second or 0.0):
        worst, corner = _worst(point.corners or [], quantity)
        here, size = error(point.error[quantity]), step(point.resolution, point.step)
        table.add_row(Text(name_of(point)), size, here, worst, Text(corner))
    return table


def _worst(corners: Sequence[Corner], quantity: str) -> tuple[str, str]:
    """Text of the largest error over all corners, and its corner; a missing result counts as the largest."""
    missing = [corner for corner in corners if corner.errors.get(quantity) is None]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        return "–", f"{listed(missing[0].parameters)}{more}: {missing[0].message}"
    corner = max(corners, key=lambda c: c.errors[quantity])
    return error(corner.errors[quantity]), listed(corner.parameters)
