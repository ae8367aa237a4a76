"""Texts of a trade-off and of a recommendation: for the terminal within 100 columns, and sentences for the page."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence
from typing import TYPE_CHECKING

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.engine_abilities import by_hand
from proofroll.core.number_format import error, number
from proofroll.report.labels import curve_names, family_and_caveat, listed, name_of, omitted_lines, step, with_caveat
from proofroll.report.page.choice_matrix import FIRST_TOLERANCE
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll.running.timing import CONFIDENCE
from proofroll.studies.tradeoff.pareto import costs_overlap

if TYPE_CHECKING:
    from proofroll.studies.study_store import Measured
    from proofroll.studies.tradeoff.recommend import Choice, Recommendation
    from proofroll.studies.tradeoff.records import Corner, CurveBudget, MeasuredPoint, TradeoffStudy

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


def holding(study: TradeoffStudy) -> tuple[list[MeasuredPoint], int]:
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
    """Parts of a trade-off's text: its fronts or all its points, the makeup of errors, and the conclusions.

    Args:
        study: the measured trade-off.
        shown: quantities with a column; the last tables are about the first of them.
        every_point: True to list all points and describe errors in sentences, too.
    """
    if every_point:
        yield point_table(study, study.points, shown, "Every point")
    else:
        yield from front_tables(study, shown)
    if study.over:
        yield from ("", corner_table(study, shown[0]))
    yield from ("", budget_table(study, shown[0]), "")
    if every_point:
        yield from (f"{item.curve}: {item.sentence}" for item in study.budgets if item.quantity == shown[0])
    yield from study.findings
    yield from (f"{name}: {reason}" for name, reason in study.absent.items())
    yield from (f"?? {line}" for line in study.claims.undecided)
    yield from (f"!! {line}" for line in study.claims.contradictions)


def point_table(
    study: TradeoffStudy,
    points: Sequence[MeasuredPoint],
    quantities: Sequence[str],
    title: str,
    ties: Collection[int] | None = None,
) -> Table:
    """Table of points, one line each: cost, and error in each quantity.

    ``ties``: numbers of the points of a front whose cost is not distinguishable from that of the next; None: no front.
    A front shows the errors that define it: the largest of a run and of the next finer runs.
    """
    caption = Text("cost: wall seconds per simulated second through this adapter")
    if ties:
        caption += Text("; ≈ a tie: the cost of a more accurate one is the same within its interval")
    lucky = [
        name for p in points for name in quantities if name in p.error and p.envelope_of(name) > (p.error[name] or 0.0)
    ]
    if lucky and ties is not None:
        caption += Text("; errors: where a run comes close by luck that of the next finer ones, which are worse")
    errors = numeric(*(f"{study.quantities[name].symbol} [{study.quantities[name].unit}]" for name in quantities))
    table = plain_table(*unbroken("engine formulation setting", "step", "cost s/s"), *errors, title=title)
    table.caption = caption
    for point in points:
        by_name = point.error if ties is None else point.envelope
        shown = [error(by_name.get(name)) if name in point.error else "–" for name in quantities]
        if point.status != "done":
            shown = [str(point.status), *[""] * (len(quantities) - 1)]
        mark = " ≈" if point.id in (ties or ()) else ""
        table.add_row(Text(name_of(point)), step(point.resolution, point.step), cost_of(point) + mark, *shown)
    return table


def front_tables(study: TradeoffStudy, quantities: Sequence[str]) -> Iterator[Table]:
    """Pareto front of the engines, and the front with the scene's own equations if that is better."""
    engines, everything = (study.front(key, quantities[0]) for key in ("pareto_engines", "pareto"))
    title = f"The Pareto front of the engines for {quantities[0]}: nothing is cheaper and more accurate"
    if engines:
        yield _front(study, engines, quantities, title)
    if everything != engines:
        title = "The front with the scene's own equations, which no engine needs"
        yield _front(study, everything, quantities, title)


def held_first(
    study: TradeoffStudy, points: Sequence[MeasuredPoint], quantity: str
) -> list[tuple[MeasuredPoint, bool | None]]:
    """Points of a front, each with True if it holds ``FIRST_TOLERANCE``: these first, the cheapest of them first.

    Then those that do not hold it, the most accurate first. None: the quantity has no scale, and the order is kept.
    """
    scale = study.quantities[quantity].scale if quantity in study.quantities else None
    if scale is None:
        return [(point, None) for point in points]
    told: list[tuple[MeasuredPoint, bool | None]] = [
        (point, point.envelope_of(quantity) <= FIRST_TOLERANCE * scale) for point in points
    ]
    return [pair for pair in told if pair[1]] + [pair for pair in reversed(told) if not pair[1]]


def _front(study: TradeoffStudy, points: Sequence[MeasuredPoint], quantities: Sequence[str], title: str) -> Table:
    ties = {cheap.id for cheap, fine in itertools.pairwise(points) if costs_overlap(cheap.interval, fine.interval)}
    ordered = held_first(study, points, quantities[0])
    table = point_table(study, [point for point, _ in ordered], quantities, title, ties)
    if any(holds for _, holds in ordered) and not all(holds for _, holds in ordered):
        assert isinstance(table.caption, Text)
        table.caption += Text(f"; first what holds {number(FIRST_TOLERANCE)} of the size, the cheapest first")
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


def budget_table(study: TradeoffStudy, quantity: str) -> Table:
    """Table of every curve: the makeup of its error, and the dominant part at the coarse and at the fine end."""
    unit = study.quantities[quantity].unit
    title = f"What the error of {quantity} consists of [{unit}]: the coarse end, then the fine end"
    table = plain_table(
        *unbroken("engine formulation setting", "order (declared)", "at steps [s]"),
        *numeric("limit off", "known to", "floor"),
        *unbroken("dominated by"),
        title=title,
    )
    names = curve_names(study.points)
    for item in study.budgets:
        if item.quantity != quantity:
            continue
        limit = (item.model_form, item.model_form_bar, item.floor)
        ends = [_DOMINANT.get(end, end) for end in (item.coarse, item.fine)]
        table.add_row(
            Text(names[item.curve]),
            Text(_order(item), style="yellow" if item.contradicts_declaration else ""),
            _steps(item),
            *(number(value) for value in limit),
            " → ".join(dict.fromkeys(ends)),
        )
    return table


# Short names that fit a column.
_DOMINANT = {
    "time step": "step",
    "model form": "model",
    "round-off or solver tolerance": "floor",
    "truth's own error bar": "truth",
    "too few runs reached the end": "too few runs",
    "there is no step and no tolerance": "nothing",
}


def _order(item: CurveBudget) -> str:
    declared = "" if item.declared is None else f" ({item.declared})"
    if item.order is None:
        return f"–{declared}"
    if item.order_low is None or item.order_high is None:
        return f"{item.order:.2f} ±?{declared}"  # from two differences, whose scatter is unknown
    return f"{item.order:.2f} ±{(item.order_high - item.order_low) / 2:.2f}{declared}"


def _steps(item: CurveBudget) -> str:
    """Coarsest and finest step between which the order was observed."""
    if item.order_from is None:
        return ""
    return f"{number(item.order_from)} → {number(item.order_to)}"


def answer_lines(advice: Recommendation) -> Iterator[str]:
    """Lines of a recommendation."""
    answer = advice.answer
    yield from omitted_lines(advice.omitted or [])
    asked = f"{answer.quantity} to {number(answer.tolerance)} {answer.unit}"
    if answer.choice is None:
        yield f"Nothing that was measured holds {asked} with margin."
        if answer.closest:
            yield f"Closest: {_line(answer.closest, answer.unit)}"
    else:
        yield f"For {asked}, use {_line(answer.choice, answer.unit)}"
        if not advice.affordable:
            yield f"That costs more than the {number(advice.max_cost)} s per simulated second of --max-cost."
    if answer.ties:
        tie = min(answer.ties, key=lambda t: t.point.envelope_of(answer.quantity))
        many = f"{len(answer.ties)} others tie in cost, as far as the intervals tell; the most accurate of them"
        words = many if len(answer.ties) > 1 else "A tie in cost, within the intervals"
        yield f"{words}: {_line(tie, answer.unit)}"
    for choice, words in (
        (advice.best_affordable, "Of those that cost no more"),
        (answer.runner_up, "Runner-up"),
        (answer.first_failure, "Cheaper ones fail; the most accurate of them"),
        (answer.least_model, "If this scene is all you need, its own equations do"),
    ):
        if choice:
            yield f"{words}: {_line(choice, answer.unit)}"
    yield "Costs are those of an engine through this adapter; other programs may cost more or less."
    yield _checked(advice)
    if advice.not_measured:
        yield f"Not among what was measured: {', '.join(advice.not_measured)}."
    yield _measured(advice.measured)


def _line(choice: Choice, of: str) -> str:
    point = choice.point
    text = ", ".join(filter(None, (name_of(point), step(point.resolution, point.step))))
    text += f": error {error(choice.error)} {of}, cost {cost_of(point)} s/s"
    return with_caveat(f"{text}; {choice.reason}", family_and_caveat(point)) + "."


def _checked(advice: Recommendation) -> str:
    checked = advice.checked
    over = [f"{name} {low:g} to {high:g}" for name, (low, high) in checked.parameters.items()]
    text = f"Checked over {checked.until:g} s at {listed(advice.parameters) or 'the default parameters'}"
    if over:
        text += f", and at {checked.corners} corners of {', '.join(over)}"
    return text + "; nothing is known beyond."


def _measured(measured: Measured) -> str:
    machine = measured.machine
    return f"Measured {measured.when} on {machine['processor']} ({machine['cores']} cores, {machine['system']})."
