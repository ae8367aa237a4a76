"""Where a smooth function of time first becomes positive."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq, minimize_scalar

# Between the ends of an interval the function is looked at so many times, enough for one crest.
_LOOKS = 4


def first_rise(g: Callable[[float], float], low: float, high: float, at_low: float, at_high: float) -> float | None:
    """First time at which ``g`` rises through zero between ``low`` and ``high`` [s]; None if it does not.

    A crest that rises above zero and is gone before ``high`` is found too. ``g`` may start at zero.
    """
    times = np.linspace(low, high, _LOOKS + 1)
    values = np.array([at_low, *(g(float(t)) for t in times[1:-1]), at_high])
    top = int(np.argmax(values))
    if values[top] <= 0 and 0 < top < _LOOKS:
        crest = minimize_scalar(
            lambda t: -g(t), bounds=(times[top - 1], times[top + 1]), method="bounded", options={"xatol": 1e-12}
        )
        if -crest.fun > 0:
            times, values = np.insert(times, top, crest.x), np.insert(values, top, -crest.fun)
            order = np.argsort(times)
            times, values = times[order], values[order]
    positive = np.flatnonzero(values > 0)
    if not positive.size:
        return None
    index = int(positive[0])
    if index == 0:
        negative = np.flatnonzero(values <= 0)
        if not negative.size or not np.any(values[negative[0] :] > 0):
            return low
        index = int(negative[0] + np.flatnonzero(values[negative[0] :] > 0)[0])
    if values[index - 1] >= 0:
        return float(times[index - 1])
    return float(brentq(g, times[index - 1], times[index], xtol=1e-14, rtol=1e-15))
