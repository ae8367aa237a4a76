"""The error budget of a curve: model form, time step with its order, round-off or solver tolerance, truth.

The run with step h is x(h). With the limit x(0) of small steps, estimated from the finest runs alone, its distance
from the truth is at most |x(h) - x(0)| (the time step) + |x(0) - truth| (the model form) + the truth's own error bar;
what keeps the fine runs from coming closer to one another is the floor of round-off and solver tolerances.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.convergence import Limit, observed_order, richardson, size, tightest
from proofroll.studies.curve import Curve, CurvePoint

# Neighbouring local orders this near to each other belong to one power law.
_SAME_ORDER = 0.3
# Differences that shrink with less than this order do not shrink.
_STALLED = 0.25
# Differences this many times larger than the scatter are more than scatter.
_ABOVE = 3.0
# How far a declared order may lie outside the interval of the observed one before it is a finding.
_SLACK = 0.25
_CONFIDENCE = 0.95

NOTHING = "there is no step and no tolerance"
TIME_STEP, MODEL_FORM, FLOOR, TRUTH = (
    "time step",
    "model form",
    "round-off or solver tolerance",
    "truth's own error bar",
)


class Order(NamedTuple):
    """An order of convergence, and where it was observed; all None where no power law shows.

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


@dataclass(frozen=True)
class Budget:
    """What the error of one quantity consists of along a curve; lengths of error in the quantity's unit.

    Attributes:
        quantity: the observable.
        model_form: distance of the limit of small steps from the truth; None where too few runs reached the end.
        model_form_bar: uncertainty of that limit.
        order: observed order of the time step; None with an adaptive step or where no power law shows.
        order_low, order_high: its confidence interval of 95 %; None from too few runs.
        order_from, order_to: coarsest and finest step of the runs that follow that power law [s]; outside them the
            order is not claimed.
        declared: order that the engine declares.
        floor: how far the finest runs scatter, where refining them no longer helps; None: not reached.
        truth: error bar of the truth; None: it is not finite.
        coarse, fine: what dominates at either end.
        coarse_step, fine_step: those ends.
        fine_error: error at the fine end.
    """

    quantity: str
    model_form: float | None
    model_form_bar: float | None
    order: float | None
    order_low: float | None
    order_high: float | None
    declared: int | None
    floor: float | None
    truth: float | None
    coarse: str
    fine: str
    coarse_step: float | None = None
    fine_step: float | None = None
    fine_error: float | None = None
    order_from: float | None = None
    order_to: float | None = None

    @property
    def contradicted(self) -> bool:
        """Whether the declared order lies outside the interval of the observed one."""
        if self.declared is None or self.order_low is None or self.order_high is None:
            return False
        return not self.order_low - _SLACK <= self.declared <= self.order_high + _SLACK


def budget(curve: Curve, quantity: str, every: float, true: FloatArray) -> Budget:
    """The budget of one quantity along a curve.

    Args:
        curve: swept.
        quantity: an observable.
        every: sampling interval of the runs from which order and limit come [s]. One with a longer step has fewer
            samples, and only the coarsest of them counts, as the coarse end.
        true: the true values.
    """
    used = [p for p in curve.points if p.case.every == every and np.isfinite(p.errors.get(quantity, np.inf))]
    declared = curve.facts.order
    if len(used) < 3:
        nothing = "too few runs reached the end" if curve.facts.resolution else NOTHING
        return Budget(
            quantity, None, None, None, None, None, declared, None, _known(_bar(used, quantity)), nothing, nothing
        )
    values = [point.curves[quantity] for point in used]
    steps = [point.step or 0.0 for point in used]
    differences = [size(a - b) for a, b in itertools.pairwise(values)]
    if curve.fixed_step:
        limit = richardson(values[-3:], steps[-3:], declared)
        stalled = not observed_order(differences[-2], differences[-1], steps[-3:]) > _STALLED
        seen = differences
        if stalled:  # what lies in the scatter of the finest runs shows no order
            scatter = _ABOVE * max(differences[-2:])
            seen = list(itertools.takewhile(lambda difference: difference > scatter, differences))
        order = order_of(steps[: len(seen) + 1], seen)
    else:
        limit, order = tightest(values), Order()
        # A tolerance that limits nothing any more gives the same run again; one at the floor gives scatter.
        stalled = differences[-1] >= differences[-2]
    floor = max(differences[-2:]) if stalled else None
    model_form, bar = size(limit.values - true), _bar(used, quantity)
    first, departure = _coarse_end(curve, quantity, every, limit) or (used[0], values[0] - limit.values)
    coarse, fine = (_dominant(away, limit, model_form, floor, bar) for away in (departure, values[-1] - limit.values))
    error = used[-1].errors[quantity]
    return Budget(
        quantity,
        model_form,
        limit.error_bar,
        order.value,
        order.low,
        order.high,
        declared,
        floor,
        _known(bar),
        coarse,
        TRUTH if error <= bar else fine,
        first.step or 0.0,
        steps[-1],
        error,
        order.coarsest,
        order.finest,
    )


def order_of(steps: Sequence[float], differences: Sequence[float]) -> Order:
    """Order and its confidence interval from the longest stretch of runs that follow one power law.

    The difference of neighbouring runs is C |h1^p - h2^p|; C and p are fitted in logarithms.

    Args:
        steps: falling.
        differences: between runs with neighbouring steps, one fewer.
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
    half = float(t.ppf(0.5 + _CONFIDENCE / 2, len(pairs) - 2) * np.sqrt(covariance[1, 1]))
    return Order(float(order), float(order) - half, float(order) + half, *between)


def _stretch(local: Sequence[float]) -> tuple[int, int]:
    """First and past-the-last index of the longest run of local orders that agree; the finer of equally long ones."""
    best = (0, 0)
    for start in range(len(local)):
        end = start
        while end < len(local) and local[end] > _STALLED and np.ptp(local[start : end + 1]) <= _SAME_ORDER:
            end += 1
        if end > start and end - start >= best[1] - best[0]:
            best = (start, end)
    return best


def _known(bar: float) -> float | None:
    return bar if np.isfinite(bar) else None


def _bar(points: Sequence[CurvePoint], quantity: str) -> float:
    return max((point.bars.get(quantity, 0.0) for point in points), default=0.0)


def _coarse_end(curve: Curve, quantity: str, every: float, limit: Limit) -> tuple[CurvePoint, FloatArray] | None:
    """The coarsest run that reached the end, and how far it is from the limit; None if it cannot be compared.

    With a step longer than the sampling interval it has only some of the limit's samples.
    """
    done = (p for p in curve.points if p.case.every > every and np.isfinite(p.errors.get(quantity, np.inf)))
    point = next(done, None)
    if point is None:
        return None
    stride, at_start = round(point.case.every / every), len(limit.values) > round(point.case.until / every)
    values, common = point.curves[quantity], limit.values[0 if at_start else stride - 1 :: stride]
    return (point, values - common) if values.shape == common.shape else None


def _dominant(departure: FloatArray, limit: Limit, model_form: float, floor: float | None, truth: float) -> str:
    """What the error of a run at some distance from the limit of small steps mostly is."""
    # Where the runs still approach one another, what is not known of their limit is the time step's too.
    time_step = max(size(departure), limit.error_bar if floor is None else 0.0)
    parts = {TIME_STEP: time_step, TRUTH: truth, FLOOR: floor or 0.0}
    # A limit that is no further from the truth than it is uncertain says nothing about the model.
    parts[MODEL_FORM] = model_form if model_form > limit.error_bar + truth else 0.0
    return max(parts, key=lambda name: parts[name])


def sentence(found: Budget, unit: str, resolution: str) -> str:
    """What dominates the error at each end, for a person."""
    if found.model_form is None or found.model_form_bar is None:
        return f"{found.coarse[0].upper()}{found.coarse[1:]}."
    step = " s" if resolution == "dt" else ""
    coarse, fine = found.coarse, found.fine
    if resolution != "dt":
        coarse, fine = (name.replace(TIME_STEP, "step control") for name in (coarse, fine))
    said = f"At {resolution} {found.coarse_step:.3g}{step} the {coarse} dominates{_order(found)}; "
    said += f"at {found.fine_step:.3g}{step}, with an error of {found.fine_error:.2g} {unit}, "
    said += "still it does" if fine == coarse else f"the {fine}"
    if found.truth is None:
        said += ". Nothing is known of the model itself: the truth's error bar is not finite"
    elif found.model_form > found.model_form_bar + found.truth:
        said += (
            f". In the limit of small steps {found.model_form:.2g} {unit} remain (known to {found.model_form_bar:.1g})"
        )
    else:
        seen = max(found.model_form_bar, found.truth)
        said += f". No error of the model itself is seen above {seen:.1g} {unit}"
    if found.floor is not None:
        said += f"; refining ends at a scatter of {found.floor:.1g} {unit}"
    return said + "."


def _order(found: Budget) -> str:
    if found.order is None:
        return ""
    declared = "" if found.declared is None else f", declared {found.declared}"
    seen = f" from {found.order_from:.3g} s to {found.order_to:.3g} s{declared}"
    if found.order_low is None or found.order_high is None:
        return f" (order {found.order:.2f}{seen})"
    return f" (order {found.order:.2f} ± {(found.order_high - found.order_low) / 2:.2f}{seen})"
