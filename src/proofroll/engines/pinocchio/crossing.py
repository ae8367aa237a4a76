"""First time at which a smooth function becomes positive: of time, or of the state in the last step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.integrators import inside_last_step

# Between the ends of an interval the function is looked at so many times, enough for one crest.
_LOOKS = 4


def first_rise(g: Callable[[float], float], low: float, high: float, at_low: float, at_high: float) -> float | None:
    """First time at which ``g`` rises through zero between ``low`` and ``high`` [s]; None if it does not.

    A crest that rises above zero and is gone before ``high`` is found too. ``g`` may start at zero.
    """
    from scipy.optimize import brentq, minimize_scalar

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


def located(
    solver: Any, g: Callable[[FloatArray], float], before: float, after: float, span: float
) -> tuple[float, float, FloatArray] | None:
    """First rise of ``g`` through zero in the last step of a DOP853 ``solver``.

    Args:
        solver: after a step.
        g: function of the state.
        before: its value at the start of the step.
        after: its value at the end.
        span: [s] over which the slope of ``g`` is measured.

    Returns:
        Time [s], half the width of its bracket [s], and the state then; None if ``g`` does not rise through zero.
    """
    dense = solver.dense_output()
    low, high = float(solver.t_old), float(solver.t)
    time = first_rise(lambda t: g(dense(t)), low, high, before, after)
    if time is None:
        return None
    # The dense output is of lower order than the steps: Newton's method on states that were integrated there.
    y, width = inside_last_step(solver, time), 0.0
    for _ in range(3):
        rates = solver.fun(time, y)
        slope = (g(y + span * rates) - g(y - span * rates)) / (2 * span)
        better = time - g(y) / slope if slope > 0 else time
        if not low <= better <= high or abs(better - time) > 0.1 * (high - low):
            break  # a crest that only touches zero has no slope to go by
        width = abs(better - time)
        if width <= 2 * np.spacing(time):
            break
        time, y = better, inside_last_step(solver, better)
    return time, width, y
