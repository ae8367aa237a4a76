"""One number of a model, chosen so that it explains residuals best."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from proofroll.core.arrays import FloatArray

_ROUNDS = 8
_STEP = 1e-4
# A step that is coarse for a motion changes its equations as a factor near one does (Hairer, Lubich and Wanner 2006,
# chapter IX: modified equations); a factor that nobody makes by mistake says nothing nearer to one than this.
_METHOD = 1e-2
# Numbers that mistakes make: a fitted factor this near to one of them is taken to be it.
_NEAR = 2e-3
_NOTHING = 1e-5
FACTORS: Mapping[float, str] = {
    0.0: "left out",
    -1.0: "with the wrong sign",
    0.5: "halved",
    2.0: "counted twice",
    1000.0: "a thousand times, as with a wrong prefix of its unit",
    1e-3: "a thousandth, as with a wrong prefix of its unit",
    180 / np.pi: "in degrees instead of radians",
    np.pi / 180: "taken for degrees",
    5 / 3: "5/3 times, as that of a thin shell instead of a solid ball",
    2 * np.pi: "times 2 pi, as turns for radians",
}


def fitted(residual: Callable[[float], FloatArray], start: float, size: float) -> float:
    """The number for which the residuals have the smallest sum of squares, by Gauss-Newton with halved steps."""
    x, at = start, residual(start)
    for _ in range(_ROUNDS):
        slope = (residual(x + _STEP * size) - at) / (_STEP * size)
        denominator = float(slope @ slope)
        if not np.isfinite(denominator) or denominator == 0:
            return x
        step = -float(slope @ at) / denominator
        for _ in range(6):
            tried = residual(x + step)
            if np.all(np.isfinite(tried)) and tried @ tried <= at @ at:
                break
            step /= 2
        else:
            return x
        x, at = x + step, tried
        if abs(step) < 1e-9 * size:
            break
    return x


def known_factor(factor: float) -> tuple[float, str] | None:
    """The number that a mistake makes, and its words, if a factor is one."""
    for value, words in FACTORS.items():
        if abs(factor - value) <= (_NEAR * abs(value) or _NOTHING):
            return value, words
    return None


def said_factor(factor: float) -> str:
    """A factor in words."""
    known = known_factor(factor)
    return known[1] if known else f"{factor:.6g} times"


def telling(factor: float) -> bool:
    """Whether a factor is a mistake's, or too far from one for a method's error."""
    return known_factor(factor) is not None or abs(factor - 1) > _METHOD
