"""What a ladder of steps tells: the observed order, and the limit of small steps with its uncertainty."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray

# A ladder is asymptotic if its observed order is the scheme's to this much.
_ASYMPTOTIC = 0.1
# Orders among which the observed one is looked for
_ORDERS = (1e-3, 20.0)
# Differences that shrink more slowly than this say nothing about a limit.
_NO_CONVERGENCE = 0.25


@dataclass(frozen=True)
class Limit:
    """Limit of a curve for small steps.

    Attributes:
        values: Richardson's extrapolation, shape (time,).
        error_bar: its uncertainty, largest over time: twice what the last extrapolation changed, or, where the order
            is no integer, how far two extrapolations differ.
        order: observed order of convergence, NaN where there is none in (0, 20].
        shown: whether the differences shrink, so that there is a limit to speak of.
    """

    values: FloatArray
    error_bar: float
    order: float
    shown: bool = True


def richardson(curves: Sequence[FloatArray], steps: Sequence[float], declared: int | None = None) -> Limit:
    """Extrapolates three curves computed with three steps, coarse first.

    The observed order p follows from the size of the two differences (Roache 1998, section 5.9). Where it is that of
    the scheme the ladder is asymptotic: the extrapolation removes the term h^p, then h^(p+1), and is trusted to twice
    its last change. So it is where curves show another whole order and differ by one shape, which scatter does not; the
    bar then has what the rounding of that order changes, too. Elsewhere extrapolating would spread the error of the
    coarse curves; the finest curve stands for the limit, trusted to twice what the last refinement changed (more, where
    the order is below one).

    Args:
        curves: three arrays of one shape.
        steps: their steps, falling; only the ratios matter.
        declared: order of the scheme; None: the nearest integer to the observed one.
    """
    coarse, middle, fine = curves
    h = np.asarray(steps, dtype=np.float64) / steps[-1]
    first, last = size(middle - coarse), size(fine - middle)
    if last == 0:  # exact, or told in steps that are coarser than what the refinement changed
        return Limit(fine, first, float("nan"))
    order = observed_order(first, last, h)
    if not np.isfinite(order) or order < _NO_CONVERGENCE:
        # The finest curve, as uncertain as the largest change seen; from one that vanishes at once no order follows.
        return Limit(fine, max(first, last), float("nan"), shown=last < first * (h[1] / h[0]) ** _NO_CONVERGENCE)
    power, rounding = declared or max(1, round(order)), 0.0
    if abs(order - power) > _ASYMPTOTIC:
        power = max(1, round(order))
        of_one_shape = size((fine - middle) - (middle - coarse) * last / first) <= _ASYMPTOTIC * last
        if abs(order - power) > _ASYMPTOTIC or not of_one_shape:
            return Limit(fine, 2 * last * max(1.0, 1 / (h[1] ** order - 1)), order)
        rounding = last * abs(1 / (h[1] ** order - 1) - 1 / (h[1] ** power - 1))
    before = middle + (middle - coarse) / ((h[0] / h[1]) ** power - 1)
    after = fine + (fine - middle) / (h[1] ** power - 1)
    # What the two extrapolations keep of the term h^(p+1)
    kept = [_kept(h[0], h[1], power), _kept(h[1], h[2], power)]
    values = after + (after - before) * kept[1] / (kept[0] - kept[1])
    return Limit(values, 2 * max(size(values - after), rounding), order)


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


def _kept(coarse: float, fine: float, power: int) -> float:
    """What extrapolating from two steps leaves of a term h^(p+1), as its factor."""
    return float(fine ** (power + 1) - (coarse ** (power + 1) - fine ** (power + 1)) / ((coarse / fine) ** power - 1))


def tightest(curves: Sequence[FloatArray]) -> Limit:
    """Limit of an adaptive method: its tightest curve, as uncertain as the last tightening changed it."""
    changes = [size(after - before) for before, after in itertools.pairwise(curves)]
    return Limit(curves[-1], changes[-1], float("nan"), shown=len(changes) == 1 or changes[-1] < changes[-2])


def size(values: FloatArray) -> float:
    """Largest magnitude of a curve."""
    return float(np.max(np.abs(values)))
