"""Extrapolated midpoint rule in long doubles (W. B. Gragg, SIAM J. Numer. Anal. 2, 1965, 384)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Long = Any  # an array of np.longdouble, for which numpy.typing has no exact name on every platform
_COLUMNS = 8
_TIGHT = 1e-17  # of each step, relative to max(1, |state|)
_SMALLEST = 1e-9  # s


def extrapolated(rate: Callable[[Long], Long], start: Long, times: Long) -> list[Long]:
    """States at growing times, s.

    Raises:
        ArithmeticError: no step is small enough.
    """
    state, now, step, found = start, np.longdouble(0), np.longdouble(0.01), []
    for time in times:
        while now < time:
            state, length, step = tight_step(rate, state, step, time - now)
            now += length
        found.append(state)
    return found


def tight_step(
    rate: Callable[[Long], Long], state: Long, step: Any, most: Any, tight: float = _TIGHT
) -> tuple[Long, Any, Any]:
    """The state after one step [s] of at most ``most``; how long it was, and how long the next may be.

    Raises:
        ArithmeticError: no step is small enough.
    """
    length = min(step, most)
    while True:
        moved, error = one_step(rate, state, length)
        if error <= tight or not length > _SMALLEST:
            break
        step = length = length * max(0.2, min(0.7, 0.8 * (tight / error) ** (1 / (2 * _COLUMNS - 1))))
    if not error < 1e-13:
        raise ArithmeticError("the referee's steps fell to nothing")
    grows = min(2.0, 0.8 * (tight / max(error, 1e-22)) ** (1 / (2 * _COLUMNS - 1)))
    return moved, length, step if length < step else length * grows  # one that was cut says nothing of the next


def one_step(rate: Callable[[Long], Long], state: Long, length: Any) -> tuple[Long, float]:
    """The state after a step, and how far its last two extrapolations differ, relative to max(1, |state|)."""
    first = rate(state)
    before: list[Long] = []
    now: list[Long] = []
    for column in range(_COLUMNS):
        count = 2 * (column + 1)
        now = [_midpoint(rate, state, first, length, count)]
        for k, coarser in enumerate(before):
            ratio = (np.longdouble(count) / (2 * (column - k))) ** 2
            now.append(now[k] + (now[k] - coarser) / (ratio - 1))
        before = now
    scale = np.maximum(1, np.abs(now[-1]))
    return now[-1], float((np.abs(now[-1] - now[-2]) / scale).max())


def _midpoint(rate: Callable[[Long], Long], state: Long, first: Long, length: Any, count: int) -> Long:
    h = length / count
    old, new = state, state + h * first
    for _ in range(count - 1):
        old, new = new, old + 2 * h * rate(new)
    return (old + new + h * rate(new)) / 2
