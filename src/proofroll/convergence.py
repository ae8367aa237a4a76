"""What a ladder of steps tells: the observed order, and the limit of small steps with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.surfaces import FloatArray


@dataclass(frozen=True)
class Limit:
    """Limit of a curve for small steps.

    Attributes:
        values: Richardson's extrapolation, shape (time,).
        error_bar: its uncertainty, largest over time: twice what the last extrapolation changed.
        order: observed order of convergence, NaN where the differences do not shrink.
    """

    values: FloatArray
    error_bar: float
    order: float


def richardson(curves: Sequence[FloatArray], ratio: float) -> Limit:
    """Extrapolates three curves computed with steps h ratio², h ratio and h (coarse first).

    The observed order p follows from the size of the two differences (Roache 1998, section 5.9); the extrapolation
    removes the term h^p, then h^(p+1).

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
    # An integer order is a fact of the scheme; the observed one carries the noise of the coarsest curve.
    power = max(1, round(order)) if abs(order - round(order)) < 0.25 else order
    gain = ratio**power - 1
    before, after = middle + (middle - coarse) / gain, fine + (fine - middle) / gain
    values = after + (after - before) / (ratio ** (power + 1) - 1)
    # Twice: the usual safety factor on an extrapolation from three grids (Roache 1998 argues for 1.25 to 3).
    return Limit(values, 2 * _size(values - after), order)


def tightest(curves: Sequence[FloatArray]) -> Limit:
    """Limit of an adaptive method: its tightest curve, as uncertain as the last tightening changed it."""
    return Limit(curves[-1], _size(curves[-1] - curves[-2]), float("nan"))


def _size(values: FloatArray) -> float:
    return float(np.max(np.abs(values)))
