"""What a ladder of steps tells: the observed order, and the limit of small steps with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.surfaces import FloatArray

# An observed order this near to an integer is that integer.
_NEAR = 0.25

# A ladder is asymptotic if its observed order is the scheme's to this much.
_ASYMPTOTIC = 0.1
# Differences that shrink more slowly than this say nothing about a limit.
_NO_CONVERGENCE = 0.25


@dataclass(frozen=True)
class Limit:
    """Limit of a curve for small steps.

    Attributes:
        values: Richardson's extrapolation, shape (time,).
        error_bar: its uncertainty, largest over time: twice what the last extrapolation changed, or, where the order
            is no integer, how far two extrapolations differ.
        order: observed order of convergence, NaN where the differences do not shrink.
    """

    values: FloatArray
    error_bar: float
    order: float


def richardson(curves: Sequence[FloatArray], ratio: float, declared: int | None = None) -> Limit:
    """Extrapolates three curves computed with steps h ratio², h ratio and h (coarse first).

    The observed order p follows from the size of the two differences (Roache 1998, section 5.9). Where it is that of
    the scheme the ladder is asymptotic: the extrapolation removes the term h^p, then h^(p+1), and is trusted to twice
    its last change. Where it is not, extrapolating would spread the error of the coarse curves; the finest curve then
    stands for the limit, trusted to twice what the last refinement changed (more, where the order is below one).

    Args:
        curves: three arrays of one shape.
        ratio: of neighbouring steps, above 1.
        declared: order of the scheme; None: the nearest integer to the observed one.
    """
    coarse, middle, fine = curves
    first, last = _size(middle - coarse), _size(fine - middle)
    if last == 0:
        return Limit(fine, 0.0, float("nan"))
    order = float(np.log(first / last) / np.log(ratio)) if first > 0 else float("nan")
    if not np.isfinite(order) or order < _NO_CONVERGENCE:
        # The finest curve, as uncertain as the largest change seen.
        return Limit(fine, max(first, last), float("nan"))
    power = declared or max(1, round(order))
    if abs(order - power) > _ASYMPTOTIC:
        return Limit(fine, 2 * last * max(1.0, 1 / (ratio**order - 1)), order)
    gain = ratio**power - 1
    before, after = middle + (middle - coarse) / gain, fine + (fine - middle) / gain
    values = after + (after - before) / (ratio ** (power + 1) - 1)
    return Limit(values, 2 * _size(values - after), order)


def tightest(curves: Sequence[FloatArray]) -> Limit:
    """Limit of an adaptive method: its tightest curve, as uncertain as the last tightening changed it."""
    return Limit(curves[-1], _size(curves[-1] - curves[-2]), float("nan"))


def _size(values: FloatArray) -> float:
    return float(np.max(np.abs(values)))
