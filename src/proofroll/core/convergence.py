"""Observed order of a ladder of steps, and its limit for small steps with the uncertainty."""

import itertools
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import EPSILON
from proofroll.core.number_format import number

# A ladder is asymptotic if its observed order is the scheme's to this much.
_ASYMPTOTIC = 0.1
# Orders among which the observed one is looked for
_ORDERS = (1e-3, 20.0)
# A tightening that changes less than this part of what another one does changes round-off alone.
_SAME = 1e-6
# Epsilons of a value that round-off scatters over a run.
_SCATTER = 1e3
# Two changes of a power law of the step have one shape but for this part; those of round-off have not.
_ONE_SHAPE = 0.3
# Changes that grow by more are no law's: halving the step makes four of h^-2. Times that are told in whole steps change
# by ratios of small integers, 9/2 among them, which this is none of.
_GROWS = 22**0.5
# A floor of single precision is below this part of the motion, and shorter steps are so many times worse. Seen are
# floors of 3e-8 to 2e-6 of it, with 2 to 18 times as much at steps 8 to 256 times shorter (float32; a pendulum, a
# double one, a free body); where no order shows yet, as of Euler on a top, 0.5 of it and 1.05 times as much.
_LARGE, _WORSE = 0.1, 1.5
# Runs that differ by more than this many times their round-off show orders as in doubles: seen are 0.6 of it, and 50
# where each of 40,000 steps rounds the same way.
_FAR_ABOVE = 100.0
# Differences that shrink more slowly than this say nothing about a limit.
_NO_CONVERGENCE = 0.25


@dataclass(frozen=True)
class Limit:
    """Limit of a curve for small steps.

    Attributes:
        values: Richardson's extrapolation, shape (time,).
        error_bar: its uncertainty, largest over time: how far extrapolations differ, or, where nothing is extrapolated,
            what a further refinement may still change.
        order: observed order of convergence, NaN where there is none in (0, 20].
        shown: whether the differences shrink, so that there is a limit to speak of.
        saturated: whether two tolerances gave the same run: something else limits its steps, as samples at which they
            end, and no limit of small ones follows.
        beside: effect of one step beside its events on the finest curve (:mod:`proofroll.core.beside_events`).
        rounded: whether the differences are so near to the round-off of single precision that no order shows.
        floor: of single precision that ends the refinement, as a clause; empty: none does.
    """

    values: FloatArray
    error_bar: float
    order: float
    shown: bool = True
    saturated: bool = False
    beside: float = 0.0
    rounded: bool = False
    floor: str = ""


def richardson(
    curves: Sequence[FloatArray], steps: Sequence[float], declared: int | None = None, scatter: float = 0.0
) -> Limit:
    """Extrapolates three curves computed with three steps, coarse first.

    The observed order p follows from the size of the two differences (Roache 1998, section 5.9). Where it is that of
    the scheme the ladder is asymptotic: the extrapolation removes the term h^p, then h^(p+1), and is trusted to twice
    its last change, or to what removing a term h^(p-1), which may hide beside h^p, would have made of it. So it is
    where curves show another whole order and differ by one shape, which scatter does not; the bar then has what the
    rounding of that order changes, too. Elsewhere extrapolating would spread the error of the coarse curves; the finest
    curve stands for the limit, trusted to twice what the last refinement changed (more, where the order is below one).

    In single precision each step rounds the state, so that smaller steps may be worse. Unless the differences are far
    above that scatter, an order is that of an asymptotic ladder of one shape; any other shows neither order nor limit,
    nor does one below the first, which no scheme has.

    Args:
        curves: three arrays of one shape.
        steps: their steps, falling; only the ratios matter.
        declared: order of the scheme; None: the nearest integer to the observed one.
        scatter: of one run, see :func:`scatter_of`.
    """
    coarse, middle, fine = curves
    h = np.asarray(steps, dtype=np.float64) / steps[-1]
    first, last = size(middle - coarse), size(fine - middle)
    if last == 0:  # exact, or told in steps that are coarser than what the refinement changed
        return Limit(fine, first, float("nan"))
    order = observed_order(first, last, h)
    one_law = _one_law(order, declared, (middle - coarse) / first, (fine - middle) / last) if first else False
    below_any = order < 1 - _ASYMPTOTIC  # where the motion is unstable it enlarges round-off beyond what it was
    if scatter and not one_law and (min(first, last) <= _FAR_ABOVE * scatter or below_any):
        bar = max(first, last, _walked(middle - coarse, fine - middle))
        return Limit(fine, bar, float("nan"), shown=False, rounded=True)
    if not np.isfinite(order) or order < _NO_CONVERGENCE:
        # The finest curve, as uncertain as the largest change seen; from one that vanishes at once no order follows.
        shown = last < first * (h[1] / h[0]) ** _NO_CONVERGENCE
        return Limit(fine, max(first, last, _walked(middle - coarse, fine - middle)), float("nan"), shown)
    power, rounding = declared or max(1, round(order)), 0.0
    if abs(order - power) > _ASYMPTOTIC:
        power = max(1, round(order))
        of_one_shape = size((fine - middle) - (middle - coarse) * last / first) <= _ASYMPTOTIC * last
        if abs(order - power) > _ASYMPTOTIC or not of_one_shape:
            return Limit(fine, 2 * last * max(1.0, 1 / (h[1] ** order - 1)), order)
        rounding = last * abs(1 / (h[1] ** order - 1) - 1 / (h[1] ** power - 1))
    before = middle + (middle - coarse) / ((h[0] / h[1]) ** power - 1)
    after = fine + (fine - middle) / (h[1] ** power - 1)
    finer = _removes(power + 1, h, power)
    hidden = _removes(power - 1, h, power) if power > 1 else 0.0
    change = size(after - before)
    bar = max(2 * abs(finer) * change, abs(hidden - finer) * change, 2 * rounding)
    return Limit(after + (after - before) * finer, bar, order)


def _one_law(order: float, declared: int | None, before: FloatArray, after: FloatArray) -> bool:
    """True if two changes, over their sizes, follow one power law of the step, with the declared or a whole order."""
    whole = declared or (round(order) if np.isfinite(order) else 0)
    return abs(order - whole) <= _ASYMPTOTIC and whole > 0 and size(after - before) <= _ONE_SHAPE


def _walked(first: FloatArray, last: FloatArray) -> float:
    """Estimated sum of three further changes, on average, if these two grow in one direction; else zero.

    By more than a factor of four, what halving does to h^-2, no law grows: that is a jump of one of the runs.
    """
    growth = size(last) / max(size(first), sys.float_info.min)
    if not 1 < growth <= _GROWS or size(last - growth * first) > size(last) / 2:
        return 0.0
    return size(last) * (growth + growth**2 + growth**3) / 3


def observed_order(first: float, last: float, steps: Sequence[float] | FloatArray) -> float:
    """The p with which h1^p - h2^p stands to h2^p - h3^p as the two differences do; NaN if there is none in (0, 20].

    Args:
        first: size of the difference between the coarse and the middle curve.
        last: of that between the middle and the fine one.
        steps: the three steps h1 > h2 > h3.
    """
    from scipy.optimize import brentq

    if not (first > 0 and last > 0):
        return float("nan")
    h1, h2, h3 = (float(step) / float(steps[-1]) for step in steps)

    def excess(p: float) -> float:
        return float(np.log((h1**p - h2**p) / (h2**p - h3**p)) - np.log(first / last))

    low, high = _ORDERS
    return float(brentq(excess, low, high)) if excess(low) < 0 < excess(high) else float("nan")


def _removes(term: int, h: FloatArray, power: int) -> float:
    """Factor by which the change between two extrapolations is added again to remove a term h^term."""
    before, after = (
        float(fine**term - (coarse**term - fine**term) / ((coarse / fine) ** power - 1))
        for coarse, fine in itertools.pairwise(h)
    )
    return after / (before - after)


def tightest(curves: Sequence[FloatArray]) -> Limit:
    """Limit of an adaptive method: its tightest curve.

    It is as uncertain as what the last tightening changed, or as all further ones would if each shrank as that one did;
    where one changed nothing, or all changed round-off, as what all did: two such changes that are nearly alike would
    otherwise be extrapolated as a slow convergence.
    """
    changes = [size(after - before) for before, after in itertools.pairwise(curves)]
    if min(changes) <= _SAME * max(changes):
        return Limit(curves[-1], max(changes), float("nan"), shown=False, saturated=True)
    if max(changes) <= _SCATTER * np.finfo(np.float64).eps * size(curves[-1]):
        return Limit(curves[-1], max(changes), float("nan"), shown=True)
    shown, last = len(changes) == 1 or changes[-1] < changes[-2], changes[-1]
    rest = last / (changes[-2] / last - 1) if shown and len(changes) > 1 and last > 0 else 0.0
    return Limit(curves[-1], max(last, rest), float("nan"), shown)


def scatter_of(precision: str, size: float, steps: float) -> float:
    """Round-off that single precision scatters over a run of so many steps, a random walk; zero in doubles.

    ``size`` is that of the numbers, :meth:`proofroll.studies.judging.reference.Reference.magnitude`.
    """
    return EPSILON[precision] * size * steps**0.5 if precision == "single" else 0.0


def is_floor(errors: Sequence[float], scale: float | None) -> bool:
    """True if the errors of ever shorter steps reach a floor of single precision.

    The least is small against the scale of the observable, should it have one, and some step is clearly worse than a
    longer one: before the order of a scheme shows, errors may be as large as the motion and rise a little, too.
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


def size(values: FloatArray) -> float:
    """Largest magnitude of a curve."""
    return float(np.max(np.abs(values)))
