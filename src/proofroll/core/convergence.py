"""Observed order of convergence of a ladder of steps, and its limit for small steps with an error bar."""

import itertools
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from proofroll.core.arrays import FloatArray, Vectors, largest_magnitude
from proofroll.core.engine import EPSILON
from proofroll.core.number_format import number

_Size = Callable[[FloatArray], float]
# Number of steps in a ladder: the fewest that show an order.
LADDER_RUNGS = 3
# A ladder is asymptotic if its observed order differs from the scheme's by at most this.
_ASYMPTOTIC = 0.1
# Furthest an observed order is from the scheme's where steps that are not yet asymptotic approach it.
_TOWARDS = 0.5
# Range of orders in which the observed one is searched.
_ORDERS = (1e-3, 20.0)
# A tightening of the tolerance that changes less than this fraction of another tightening changes round-off alone.
_SAME = 1e-6
# Round-off accumulated over a run, in machine epsilons of the value.
_SCATTER = 1e3
# Two changes of a power law of the step, normalised, differ by at most this; those of round-off differ by more.
_ONE_SHAPE = 0.3
# Growth of changes from one refinement to the next above which no power law explains them: halving the step makes a
# change by h^-2 four times larger. It is no ratio of small integers (9/2 is one), by which times in whole steps change.
_GROWS = 22**0.5
# Single precision sets a floor if the least error is below _LARGE of the motion and a shorter step has more than _WORSE
# times that error. Measured in float32 (pendulum, double pendulum, free body): least errors of 3e-8 to 2e-6 of the
# motion, 2 to 18 times more at steps 8 to 256 times shorter; with steps too long to show an order (Euler on a top),
# 0.5 of the motion and 1.05 times more.
_LARGE, _WORSE = 0.1, 1.5
# Runs that differ by more than this many times their round-off show orders as in doubles. Measured where no order
# shows: 0.6 times, and 50 times where each of 40,000 steps rounds the same way.
_FAR_ABOVE = 100.0
# Observed orders below this show no limit.
_NO_CONVERGENCE = 0.25


@dataclass(frozen=True)
class Limit:
    """Limit of a curve for small steps.

    Attributes:
        values: Richardson's extrapolation, or the finest curve, shape (time,).
        error_bar: its uncertainty, largest over time: the difference of extrapolations, or, without extrapolation, the
            change that further refinement may still make.
        order: observed order of convergence, NaN where there is none in (0, 20].
        shown: True if the differences shrink, so that there is a limit to speak of.
        saturated: True if two tolerances gave the same run but for round-off: something else (samples at which steps
            end) limits the steps, so that no limit of small steps follows.
        beside: effect on the finest curve of events that are one step late .
        chance: further doubt in a limit whose order is not the scheme's: its last change may be small by chance, or the
            next order may yet show.
        regular: True if the differences follow one power of the step, or come from tolerances; only then do they show
            that a limit is not the truth.
        unsettled: clause on the event behind which the steps do not settle; empty: none is known.
        rounded: True if the differences are so near to the round-off of single precision that no order shows.
        floor: clause about the error floor of single precision that ends the refinement; empty: there is none.
    """

    values: FloatArray
    error_bar: float
    order: float
    shown: bool = True
    saturated: bool = False
    beside: float = 0.0
    chance: float = 0.0
    regular: bool = True
    unsettled: str = ""
    rounded: bool = False
    floor: str = ""


def richardson(
    curves: Sequence[FloatArray],
    steps: Sequence[float],
    declared: int | None = None,
    scatter: float = 0.0,
    vectors: Vectors = None,
) -> Limit:
    """Extrapolates three curves computed with three steps, coarse first.

    The observed order p follows from the sizes of the two differences (Roache 1998, section 5.9). The ladder is
    asymptotic if p is the order of the scheme, or another whole order while both differences have the same shape over
    time (those of round-off do not). Then the extrapolation removes the term h^p and after it h^(p+1). Its error bar is
    twice the last change, or the change from removing a term h^(p-1) instead, which h^p may hide, if that is larger;
    where the order was rounded to a whole one, the bar includes the effect of rounding it. In any other ladder
    extrapolation would spread the error of the coarse curves: the limit is the finest curve, with twice the change of
    the last refinement (more if the order is below one) as its bar. An order above the scheme's may be chance in that
    change, which then may have been as large as the change before it, shrunk by the scheme's order. An extrapolation
    with another order than the scheme's proves nothing that the finest curve with its bar does not: three steps that
    are not yet asymptotic show such orders, and so do switches that the scheme steps over.

    In single precision each step rounds the state, so that shorter steps may be worse. Unless the differences are far
    above that scatter, an order counts only if the ladder is asymptotic with differences of one shape; otherwise, and
    for orders below one, which no scheme has, the result shows neither order nor limit.

    Args:
        curves: three arrays of one shape.
        steps: their steps, falling; only the ratios matter.
        declared: order of the scheme; None: the nearest integer to the observed one.
        scatter: round-off of one run, see :func:`scatter_of`.
        vectors: of the components of a curve.
    """
    coarse, middle, fine = curves
    size = partial(largest_magnitude, vectors=vectors)
    h = np.asarray(steps, dtype=np.float64) / steps[-1]
    change_1, change_2 = size(middle - coarse), size(fine - middle)
    if change_2 == 0:  # exact, or reported in increments coarser than the change by the refinement
        return Limit(fine, change_1, float("nan"))
    order = observed_order(change_1, change_2, h)
    one_law = (
        _one_law(order, declared, (middle - coarse) / change_1, (fine - middle) / change_2, size) if change_1 else False
    )
    below_any = order < 1 - _ASYMPTOTIC  # an unstable motion amplifies round-off beyond the estimated scatter
    if scatter and not one_law and (min(change_1, change_2) <= _FAR_ABOVE * scatter or below_any):
        bar = max(change_1, change_2, _walked(middle - coarse, fine - middle, size))
        return Limit(fine, bar, float("nan"), shown=False, rounded=True, regular=False)
    if not np.isfinite(order) or order < _NO_CONVERGENCE:
        # The finest curve, as uncertain as the largest change seen; from one that vanishes at once no order follows.
        shown = change_2 < change_1 * (h[1] / h[0]) ** _NO_CONVERGENCE
        bar = max(change_1, change_2, _walked(middle - coarse, fine - middle, size))
        return Limit(fine, bar, float("nan"), shown, regular=False)
    power, rounding, chance = declared or max(1, round(order)), 0.0, 0.0
    unextrapolated = 2 * change_2 * max(1.0, 1 / (h[1] ** order - 1))
    if abs(order - power) > _ASYMPTOTIC:
        power = max(1, round(order))
        of_one_shape = size((fine - middle) - (middle - coarse) * change_2 / change_1) <= _ASYMPTOTIC * change_2
        if abs(order - power) > _ASYMPTOTIC or not of_one_shape:
            chance = max(0.0, change_1 / _shrinkage(declared or order, h) - change_2)
            if declared and abs(order - declared) > _TOWARDS:
                order = float("nan")  # that of chance
            return Limit(fine, unextrapolated, order, chance=2 * chance, regular=False)
        chance = unextrapolated if declared else 0.0
        rounding = change_2 * abs(1 / (h[1] ** order - 1) - 1 / (h[1] ** power - 1))
    coarse_limit = middle + (middle - coarse) / ((h[0] / h[1]) ** power - 1)
    fine_limit = fine + (fine - middle) / (h[1] ** power - 1)
    finer = _removes(power + 1, h, power)
    hidden = _removes(power - 1, h, power) if power > 1 else 0.0
    change = size(fine_limit - coarse_limit)
    bar = max(2 * abs(finer) * change, abs(hidden - finer) * change, 2 * rounding)
    return Limit(fine_limit + (fine_limit - coarse_limit) * finer, bar, order, chance=chance)


def falls_faster(errors: Sequence[float], steps: Sequence[float]) -> bool:
    """True if errors fall at every step of a ladder, and with a clearly higher order at each.

    So fall the errors of steps that are not yet asymptotic, whatever order their differences show; a shorter step tells
    whether they reach zero or pass it.

    Args:
        errors: coarse first.
        steps: falling; only the ratios matter.
    """
    if len(errors) < LADDER_RUNGS or not all(np.isfinite(errors)) or min(errors) <= 0:
        return False
    rungs = itertools.pairwise(zip(errors, steps, strict=True))
    orders = [float(np.log(large / small) / np.log(long / short)) for (large, long), (small, short) in rungs]
    return min(orders) > 0 and all(later > earlier + _ASYMPTOTIC for earlier, later in itertools.pairwise(orders))


def _one_law(
    order: float, declared: int | None, coarse_change: FloatArray, fine_change: FloatArray, size: _Size
) -> bool:
    """True if two normalised changes follow one power law of the step, of the declared or a whole order."""
    whole = declared or (round(order) if np.isfinite(order) else 0)
    return abs(order - whole) <= _ASYMPTOTIC and whole > 0 and size(fine_change - coarse_change) <= _ONE_SHAPE


def _walked(change: FloatArray, next_change: FloatArray, size: _Size) -> float:
    """Estimated sum of three further changes if these two grow in one direction; otherwise 0.

    Growth by more than a factor of four, which halving the step makes of h^-2, is a jump of one of the runs: 0.
    """
    growth = size(next_change) / max(size(change), sys.float_info.min)
    if not 1 < growth <= _GROWS or size(next_change - growth * change) > size(next_change) / 2:
        return 0.0
    return size(next_change) * (growth + growth**2 + growth**3) / 3


def observed_order(change: float, next_change: float, steps: Sequence[float] | FloatArray) -> float:
    """Order p with (h1^p - h2^p) / (h2^p - h3^p) equal to the ratio of the two differences; NaN if none is in (0, 20].

    Args:
        change: size of the difference between the coarse and the middle curve.
        next_change: size of the difference between the middle and the fine curve.
        steps: the three steps h1 > h2 > h3.
    """
    from scipy.optimize import brentq

    if not (change > 0 and next_change > 0):
        return float("nan")
    h1, h2, h3 = (float(step) / float(steps[-1]) for step in steps)

    def excess(p: float) -> float:
        return float(np.log(_shrinkage(p, (h1, h2, h3)) * next_change / change))

    low, high = _ORDERS
    return float(brentq(excess, low, high)) if excess(low) < 0 < excess(high) else float("nan")


def _shrinkage(order: float, h: Sequence[float] | FloatArray) -> float:
    """Ratio of the first change to the last one of three steps, by a power law of this order."""
    return float((h[0] ** order - h[1] ** order) / (h[1] ** order - h[2] ** order))


def _removes(term: int, h: FloatArray, power: int) -> float:
    """Multiple of the change between two extrapolations that, added to the second, removes a term h^term."""
    coarse_term, fine_term = (
        float(fine**term - (coarse**term - fine**term) / ((coarse / fine) ** power - 1))
        for coarse, fine in itertools.pairwise(h)
    )
    return fine_term / (coarse_term - fine_term)


def tightest(curves: Sequence[FloatArray], vectors: Vectors = None) -> Limit:
    """Limit of a method with adaptive steps: the curve of its tightest tolerance.

    The error bar is the change by the last tightening, or the sum of all further changes if each shrinks as the last
    one did, whichever is larger. Where one tightening changed nothing, or all changed round-off only, it is the largest
    change: two nearly equal changes of that kind would be extrapolated as slow convergence. ``vectors``: of components.
    """
    changes = [largest_magnitude(fine - coarse, vectors) for coarse, fine in itertools.pairwise(curves)]
    if min(changes) <= _SAME * max(changes):
        return Limit(curves[-1], max(changes), float("nan"), shown=False, saturated=True)
    if max(changes) <= _SCATTER * np.finfo(np.float64).eps * largest_magnitude(curves[-1], vectors):
        return Limit(curves[-1], max(changes), float("nan"), shown=True, saturated=True)
    shown, last = len(changes) == 1 or changes[-1] < changes[-2], changes[-1]
    rest = last / (changes[-2] / last - 1) if shown and len(changes) > 1 and last > 0 else 0.0
    return Limit(curves[-1], max(last, rest), float("nan"), shown)


def scatter_of(precision: str, size: float, steps: float) -> float:
    """Round-off that single precision scatters over a run, a random walk over its steps; 0 in double precision.

    Args:
        precision: key of :data:`EPSILON`.
        size: magnitude of the numbers, :meth:`proofroll.studies.judging.reference.Reference.magnitude`.
        steps: number of steps.
    """
    return EPSILON[precision] * size * steps**0.5 if precision == "single" else 0.0


def is_floor(errors: Sequence[float], scale: float | None) -> bool:
    """True if the errors of ever shorter steps reach a floor of single precision.

    The least error must be small against the scale of the observable, if it has one, and some step must be clearly
    worse than a longer one: while steps are too long to show an order, errors are as large as the motion and may rise a
    little.
    """
    rises = any(later > _WORSE * earlier for earlier, later in itertools.combinations(errors, 2))
    return rises and (not scale or min(errors) <= _LARGE * scale)


def floor_text(step: float, error: float, unit: str) -> str:
    """Clause about the floor that single precision sets to a refinement.

    Args:
        step: with the least error [s].
        error: at that step.
        unit: of the error; 1: none.
    """
    return f"best step {number(step)} s, floor {number(error)}{'' if unit == '1' else f' {unit}'}: single precision"


def floor_of(errors: Mapping[float, float], scale: float | None, unit: str) -> str:
    """Smallest error that single precision reaches, as a clause; empty where no floor shows.

    Args:
        errors: by step [s].
        scale: of the observable; None: it has none.
        unit: of the errors; 1: none.
    """
    best = min(errors, key=lambda step: errors[step])
    falling = [errors[step] for step in sorted(errors, reverse=True)]
    return floor_text(best, errors[best], unit) if is_floor(falling, scale) else ""
