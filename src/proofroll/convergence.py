"""What a ladder of steps tells: the observed order, and the limit of small steps with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.surfaces import FloatArray

# An observed order this near to an integer is that integer.
_NEAR = 0.25


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


def richardson(curves: Sequence[FloatArray], ratio: float) -> Limit:
    """Extrapolates three curves computed with steps h ratio², h ratio and h (coarse first).

    The observed order p follows from the size of the two differences (Roache 1998, section 5.9); the extrapolation
    removes the term h^p, then h^(p+1) if p is an integer.

    Args:
        curves: three arrays of one shape.
        ratio: of neighbouring steps, above 1.
    """
    coarse, middle, fine = curves
    first, last = _size(middle - coarse), _size(fine - middle)
    if last == 0:
        return Limit(fine, 0.0, float("nan"))
    order = float(np.log(first / last) / np.log(ratio)) if first > 0 else float("nan")
    if not np.isfinite(order) or order < 0.25:
        # No convergence to speak of: the finest curve, as uncertain as the largest change seen.
        return Limit(fine, max(first, last), float("nan"))
    nearest = max(1, round(order))
    twice = _two_terms(curves, ratio, nearest)
    if abs(order - nearest) < _NEAR:
        # An integer order is a fact of the scheme; the observed one carries the noise of the coarsest curve.
        # Twice: the usual safety factor on an extrapolation from three grids (Roache 1998 argues for 1.25 to 3).
        once = fine + (fine - middle) / (ratio**nearest - 1)
        return Limit(twice, 2 * _size(twice - once), order)
    # Either a method of a fractional order or an integer order mixed with the next: nobody knows which, and the two
    # extrapolations differ by what that may matter.
    values = fine + (fine - middle) / (ratio**order - 1)
    return Limit(values, _size(values - twice), order)


def _two_terms(curves: Sequence[FloatArray], ratio: float, power: int) -> FloatArray:
    """The curves without their terms h^power and h^(power+1)."""
    coarse, middle, fine = curves
    gain = ratio**power - 1
    before, after = middle + (middle - coarse) / gain, fine + (fine - middle) / gain
    return np.asarray(after + (after - before) / (ratio ** (power + 1) - 1))


def tightest(curves: Sequence[FloatArray]) -> Limit:
    """Limit of an adaptive method: its tightest curve, as uncertain as the last tightening changed it."""
    return Limit(curves[-1], _size(curves[-1] - curves[-2]), float("nan"))


def _size(values: FloatArray) -> float:
    return float(np.max(np.abs(values)))
