"""First rise of a smooth function through zero within a step, even if it falls again in the same step."""

from collections.abc import Callable

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray

_POINTS = 20
_X = chebyshev.chebpts2(_POINTS)
_TO_CHEBYSHEV = np.linalg.inv(chebyshev.chebvander(_X, _POINTS - 1))
_FEW = chebyshev.chebpts2(6)
_OF_FEW = np.linalg.inv(chebyshev.chebvander(_FEW, len(_FEW) - 1))


def stays_negative(function: Callable[[FloatArray], FloatArray], start: float, end: float) -> NDArray[np.bool_]:
    """True for each function that is certainly negative throughout a step; shape (functions,).

    Each function is bounded by a polynomial through 6 Chebyshev points; ten times its last two terms stand for those
    that are left out. The functions must be as smooth as in a step of an integrator of high order. It spares
    :func:`first_rise` most steps.

    Args:
        function: of times, shape (times, functions).
        start: of the step [s].
        end: of the step [s].
    """
    coefficients = _OF_FEW @ function((end + start) / 2 + (end - start) / 2 * _FEW)
    sizes = np.abs(coefficients)
    negative: NDArray[np.bool_] = coefficients[0] + sizes[1:].sum(axis=0) + 10 * sizes[-2:].sum(axis=0) < 0
    return negative


def first_rise(function: Callable[[FloatArray], FloatArray], start: float, end: float) -> float | None:
    """First time in (start, end] at which a function of times passes from negative to positive, or None.

    A polynomial through 20 Chebyshev points finds every root, also the pair under a crest that lies between the ends
    of a step; two secant steps on the function itself then polish the first.
    """
    half, middle = (end - start) / 2, (end + start) / 2
    values = function(middle + half * _X)
    coefficients = _TO_CHEBYSHEV @ values
    slope = chebyshev.chebder(coefficients)
    bound = float(np.sum(np.abs(coefficients[1:])))
    if coefficients[0] + bound < 0:
        return None
    if values[0] > 0:  # above zero by round-off at the start: it rises now, or falls back
        return start if chebyshev.chebval(-1.0, slope) > 0 else None
    roots = chebyshev.chebroots(np.trim_zeros(coefficients, "b")) if np.any(coefficients) else np.empty(0)
    real = np.sort(np.real(roots[np.abs(np.imag(roots)) < 1e-9]))
    rising = [x for x in real if -1 <= x <= 1 + 1e-12 and chebyshev.chebval(x, slope) > 0]
    if not rising:
        return None
    x = rising[0]
    for _ in range(2):
        steepness = float(chebyshev.chebval(x, slope))
        value = float(function(np.array([middle + half * x]))[0])
        x = min(max(x - value / steepness, -1.0), 1.0) if abs(value) < abs(steepness) else x
    return float(middle + half * x)
