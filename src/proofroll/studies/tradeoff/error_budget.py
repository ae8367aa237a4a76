"""Error budget of a curve: model form, time step with its order, round-off or solver tolerance, truth.

A run with step h is x(h), and x(0) is the limit of small steps, estimated from the finest runs alone. The error of a
run is at most |x(h) - x(0)| (the time step) + |x(0) - truth| (the model form) + the truth's own error bar. The floor is
the difference of the finest runs if it no longer shrinks: round-off or solver tolerances.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray, largest_magnitude
from proofroll.core.convergence import (
    Limit,
    floor_text,
    observed_order,
    richardson,
    scatter_of,
    tightest,
)
from proofroll.core.number_format import number
from proofroll.core.observable import Observable, Role
from proofroll.core.verdict import round_off_of
from proofroll.running.case import EngineFacts
from proofroll.running.timing import CONFIDENCE
from proofroll.studies.tradeoff.curve import Curve, CurvePoint
from proofroll.studies.tradeoff.records import CurveBudget

# Largest range of neighbouring local orders that belong to one power law.
_SAME_ORDER = 0.3
# Least order with which differences count as shrinking.
_STALLED = 0.25
# Differences below this many times the scatter are scatter.
_ABOVE = 3.0
# Distance of a declared order from the interval of the observed one beyond which it is contradicted.
_SLACK = 0.25

NOTHING = "there is no step and no tolerance"
TIME_STEP, MODEL_FORM, FLOOR, TRUTH = (
    "time step",
    "model form",
    "round-off or solver tolerance",
    "truth's own error bar",
)


class Order(NamedTuple):
    """Observed order of convergence; all None if no power law shows.

    Attributes:
        value: of the order.
        low, high: its confidence interval of 95 %; None from too few runs.
        coarsest, finest: steps of the runs that follow the power law.
    """

    value: float | None = None
    low: float | None = None
    high: float | None = None
    coarsest: float | None = None
    finest: float | None = None


def budget(
    curve: Curve, quantity: str, every: float, true: FloatArray, observable: Observable, magnitude: float
) -> CurveBudget:
    """Error budget of one quantity along a curve.

    Order and limit come from runs sampled at ``every``. Runs with a longer step have fewer samples; only the coarsest
    of them is used, for the coarse end.

    Args:
        curve: with its points.
        quantity: name of the observable.
        every: sampling interval [s].
        true: true values.
        observable: declaration of the quantity.
        magnitude: size of the numbers whose round-off it has.
    """
    used = [p for p in curve.points if p.case.every == every and np.isfinite(p.errors.get(quantity, np.inf))]
    bar, single = _bar(used, quantity), curve.floor(quantity)
    if single:  # with smaller steps only round-off shows
        used = used[: max(sum((p.step or 0.0) >= (single.best.step or 0.0) for p in used), 3)]
    budget_of_curve = CurveBudget(
        engine=curve.facts.name,
        curve=curve.engine,
        quantity=quantity,
        declared=curve.facts.order,
        truth=bar if np.isfinite(bar) else None,
        coarse="too few runs reached the end" if curve.facts.resolution else NOTHING,
    )
    if len(used) < 3:
        return replace(
            budget_of_curve,
            fine=budget_of_curve.coarse,
            sentence=f"{budget_of_curve.coarse[0].upper()}{budget_of_curve.coarse[1:]}.",
        )
    values = [point.curves[quantity] for point in used]
    steps = [point.step or 0.0 for point in used]
    vectors = used[-1].vectors.get(quantity)
    differences = [largest_magnitude(a - b, vectors) for a, b in itertools.pairwise(values)]
    if curve.fixed_step:
        scatter = scatter_of(curve.facts.precision, magnitude, used[-1].case.until / steps[-1])
        limit = richardson(values[-3:], steps[-3:], curve.facts.order, scatter, vectors)
        stalled = not observed_order(differences[-2], differences[-1], steps[-3:]) > _STALLED
        seen = differences
        if single:
            seen = list(itertools.takewhile(lambda difference: difference > _ABOVE * single.scatter, differences))
        elif stalled:  # differences within the scatter of the finest runs show no order
            scatter = _ABOVE * max(differences[-2:])
            seen = list(itertools.takewhile(lambda difference: difference > scatter, differences))
        moved = max(differences) > round_off_of(curve.facts.precision, magnitude)  # round-off alone has no order
        order = order_of(steps[: len(seen) + 1], seen) if moved else Order()
    else:
        limit, order = tightest(values, vectors), Order()
        # Differences that no longer shrink: the tolerance has no effect, or only round-off changes.
        stalled = differences[-1] >= differences[-2]
    floor = max(differences[-2:]) if stalled else None
    if single:
        floor = single.error
    if curve.facts.precision == "single":
        limit = replace(limit, error_bar=max(limit.error_bar, floor or 0.0, round_off_of("single", magnitude)))
    model_form, error = largest_magnitude(limit.values - true, vectors), used[-1].errors[quantity]
    begin, departure = _coarse_end(curve, quantity, every, limit) or (used[0], values[0] - limit.values)
    coarse, fine = (
        _dominant(largest_magnitude(away, vectors), limit, model_form, floor, bar)
        for away in (departure, values[-1] - limit.values)
    )
    budget_of_curve = replace(
        budget_of_curve,
        model_form=model_form,
        model_form_bar=limit.error_bar,
        order=order.value,
        order_low=order.low,
        order_high=order.high,
        order_from=order.coarsest,
        order_to=order.finest,
        contradicts_declaration=_contradicted(order, curve.facts, observable.role),
        floor=floor,
        best_step=single.best.step if single else None,
        coarse=coarse,
        coarse_step=begin.step or 0.0,
        fine=TRUTH if error <= bar else fine,
        fine_step=steps[-1],
        fine_error=error,
    )
    return replace(budget_of_curve, sentence=_sentence(budget_of_curve, observable.unit, str(curve.facts.resolution)))


def _contradicted(order: Order, facts: EngineFacts, role: Role) -> bool:
    """True if the observed order lies outside the declared ones, from the one for this scene to the highest.

    An event that lowers the order (a joint that begins to slip within a step) need not happen in a run. A declared
    order is that of the motion: reactions and residuals may have a higher one.
    """
    if facts.order is None or order.low is None or order.high is None:
        return False
    if facts.order > order.high + _SLACK:
        return True
    return role == Role.MOTION and (facts.highest or facts.order) < order.low - _SLACK


def order_of(steps: Sequence[float], differences: Sequence[float]) -> Order:
    """Order and its confidence interval, from the longest sequence of runs that follow one power law.

    The difference of neighbouring runs is C |h1^p - h2^p|; C and p are fitted in logarithms.

    Args:
        steps: falling [s].
        differences: size of the difference of neighbouring runs.
    """
    from scipy.optimize import curve_fit
    from scipy.stats import t

    local = [observed_order(differences[i], differences[i + 1], steps[i : i + 3]) for i in range(len(differences) - 1)]
    start, end = _stretch(local)
    if end == start:
        return Order()
    between = steps[start], steps[end + 1]
    span = slice(start, end + 1)  # the differences that the local orders of the stretch come from
    pairs = np.array(list(itertools.pairwise(steps)), dtype=np.float64)[span]
    pairs /= pairs[-1, 1]
    if len(pairs) < 3:
        return Order(float(np.mean(local[start:end])), None, None, *between)

    def law(h: FloatArray, constant: float, power: float) -> FloatArray:
        return np.asarray(constant + np.log(np.abs(h[:, 0] ** power - h[:, 1] ** power)))

    seen = np.log(np.asarray(differences)[span])
    (_, order), covariance = curve_fit(law, pairs, seen, p0=(seen[-1], np.mean(local[start:end])))
    half = float(t.ppf(0.5 + CONFIDENCE / 2, len(pairs) - 2) * np.sqrt(covariance[1, 1]))
    return Order(float(order), float(order) - half, float(order) + half, *between)


def _stretch(local: Sequence[float]) -> tuple[int, int]:
    """First and past-the-end index of the longest sequence of equal local orders; the finest of equally long ones."""
    best = (0, 0)
    for start in range(len(local)):
        end = start
        while end < len(local) and local[end] > _STALLED and np.ptp(local[start : end + 1]) <= _SAME_ORDER:
            end += 1
        if end > start and end - start >= best[1] - best[0]:
            best = (start, end)
    return best


def _bar(points: Sequence[CurvePoint], quantity: str) -> float:
    return max((point.bars.get(quantity, 0.0) for point in points), default=0.0)


def _coarse_end(curve: Curve, quantity: str, every: float, limit: Limit) -> tuple[CurvePoint, FloatArray] | None:
    """The coarsest run that reached the end, and its difference from the limit; None if they cannot be compared.

    With a step longer than the sampling interval it has only some of the limit's samples.
    """
    done = (p for p in curve.points if p.case.every > every and np.isfinite(p.errors.get(quantity, np.inf)))
    point = next(done, None)
    if point is None:
        return None
    stride, at_start = round(point.case.every / every), len(limit.values) > round(point.case.until / every)
    values, common = point.curves[quantity], limit.values[0 if at_start else stride - 1 :: stride]
    return (point, values - common) if values.shape == common.shape else None


def _dominant(departure: float, limit: Limit, model_form: float, floor: float | None, truth: float) -> str:
    """Name of the dominating part of the error of a run with this departure from the limit of small steps."""
    # While runs still approach one another, the uncertainty of the limit counts as error of the time step.
    time_step = max(departure, limit.error_bar if floor is None else 0.0)
    parts = {TIME_STEP: time_step, TRUTH: truth, FLOOR: floor or 0.0}
    # A limit that differs from the truth by no more than its uncertainty shows no error of the model.
    parts[MODEL_FORM] = model_form if model_form > limit.error_bar + truth else 0.0
    return max(parts, key=lambda name: parts[name])


def _sentence(budget: CurveBudget, unit: str, resolution: str) -> str:
    """Sentence on the dominating part of the error at each end."""
    assert budget.model_form is not None  # there are enough runs
    assert budget.model_form_bar is not None
    step = " s" if resolution == "dt" else ""
    coarse, fine = budget.coarse, budget.fine
    if resolution != "dt":
        coarse, fine = (name.replace(TIME_STEP, "step control") for name in (coarse, fine))
    text = f"At {resolution} {number(budget.coarse_step, 3)}{step} the {coarse} dominates{_order(budget)}; "
    text += f"at {number(budget.fine_step, 3)}{step}, with an error of {number(budget.fine_error)} {unit}, "
    text += "still it does" if fine == coarse else f"the {fine}"
    if budget.truth is None:
        text += ". Nothing is known of the model itself: the truth's error bar is not finite"
    elif budget.model_form > budget.model_form_bar + budget.truth:
        bar = number(budget.model_form_bar, 1)
        text += f". In the limit of small steps {number(budget.model_form)} {unit} remain (known to {bar})"
    else:
        seen = max(budget.model_form_bar, budget.truth)
        text += f". No error of the model itself is seen above {number(seen, 1)} {unit}"
    if budget.floor is not None and budget.best_step is not None:
        text += f"; {floor_text(budget.best_step, budget.floor, unit)}, smaller steps are worse"
    elif budget.floor is not None:
        text += f"; refining ends at a scatter of {number(budget.floor, 1)} {unit}"
    return text + "."


def _order(budget: CurveBudget) -> str:
    if budget.order is None:
        return ""
    declared = "" if budget.declared is None else f", declared {budget.declared}"
    seen = f" from {number(budget.order_from, 3)} s to {number(budget.order_to, 3)} s{declared}"
    if budget.order_low is None or budget.order_high is None:
        return f" (order {budget.order:.2f}{seen})"
    return f" (order {budget.order:.2f} ± {(budget.order_high - budget.order_low) / 2:.2f}{seen})"
