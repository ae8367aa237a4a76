"""First rise of a function or guard through zero within a step, even if it falls again in the same step."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import inside_last_step

Guards = Callable[[FloatArray], FloatArray]

_POINTS = 20
_X = chebyshev.chebpts2(_POINTS)
_TO_CHEBYSHEV = np.linalg.inv(chebyshev.chebvander(_X, _POINTS - 1))
_FEW = chebyshev.chebpts2(6)
_OF_FEW = np.linalg.inv(chebyshev.chebvander(_FEW, len(_FEW) - 1))


class Rise(NamedTuple):
    """First rise of a guard through zero within a step.

    Attributes:
        time: time of the rise [s].
        width: half the width of its bracket [s].
        state: state at that time.
        guard: index of the guard.
    """

    time: float
    width: float
    state: FloatArray
    guard: int


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
    """First time in [start, end] at which a function of times passes from negative to positive, or None.

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
    # a root at an end of the step is in the step, whatever its last digits
    rising = [x for x in real if abs(x) <= 1 + 1e-12 and chebyshev.chebval(x, slope) > 0]
    if not rising:
        return None
    x = max(rising[0], -1.0)
    for _ in range(2):
        steepness = float(chebyshev.chebval(x, slope))
        value = float(function(np.array([middle + half * x]))[0])
        x = min(max(x - value / steepness, -1.0), 1.0) if abs(value) < abs(steepness) else x
    return float(middle + half * x)


def graze(function: Callable[[FloatArray], FloatArray], start: float, end: float, near: float) -> float | None:
    """Time of a crest in [start, end] whose height is zero within ``near``, or None; the crest may lie just beyond.

    A function that was never lower than -10 ``near`` before has not come near zero: it leaves it.
    """
    half, middle = (end - start) / 2, (end + start) / 2
    values = function(middle + half * _X)
    slope = chebyshev.chebder(_TO_CHEBYSHEV @ values)
    turns = chebyshev.chebroots(np.trim_zeros(slope, "b")) if np.any(slope) else np.empty(0)
    for x in np.sort(np.real(turns[np.abs(np.imag(turns)) < 1e-6])):
        t = middle + half * min(max(x, -1.0), 1.0)
        crest = chebyshev.chebval(x, chebyshev.chebder(slope)) < 0 and abs(x) < 1 + 1e-3
        if crest and values[x >= _X].min(initial=np.inf) < -10 * near and abs(float(function(np.array([t]))[0])) < near:
            return float(t)
    return None


def points_within(start: float, end: float) -> FloatArray:
    """Times in [start, end] through which functions are interpolated [s]: 20 Chebyshev points, both ends included."""
    return (end + start) / 2 + (end - start) / 2 * _X


def lowest(values: FloatArray, start: float, end: float) -> tuple[float, float] | None:
    """First time inside (start, end) at which a smooth function has a minimum, and its value; None: it has none.

    ``values``: at :func:`points_within`.
    """
    if np.argmin(values) == _POINTS - 1 and np.all(np.diff(values) <= 0):
        return None
    coefficients = _TO_CHEBYSHEV @ values
    slope = chebyshev.chebder(coefficients)
    turns = chebyshev.chebroots(np.trim_zeros(slope, "b")) if np.any(slope) else np.empty(0)
    bend = chebyshev.chebder(slope)
    found = np.sort(np.real(turns[np.abs(np.imag(turns)) < 1e-6]))
    low = [x for x in found.tolist() if abs(x) <= 1 and chebyshev.chebval(x, bend) > 0]
    return (
        ((end + start) / 2 + (end - start) / 2 * low[0], float(chebyshev.chebval(low[0], coefficients)))
        if low
        else None
    )


def locate_rise_within(
    guards: Callable[[FloatArray], FloatArray],
    start: float,
    end: float,
    noise: FloatArray | float = 0.0,
    leaving: bool = False,
    near: FloatArray | float = 0.0,
    grazes: list[float] | None = None,
    known: FloatArray | None = None,
) -> tuple[float, int] | None:
    """Time [s] and index of the first rise of a guard in a step whose dense output is as accurate as the step.

    Args:
        guards: of times, shape (times, guards); accurate within the whole step.
        start: of the step [s].
        end: of the step [s].
        noise: see :func:`locate_rise`, as for the arguments that follow.
        leaving: see there.
        near: see there.
        grazes: see there.
        known: values of the guards at :func:`points_within`; None: they are evaluated.
    """

    def values(times: FloatArray, found: FloatArray | None = None) -> FloatArray:
        found = (guards(times) if found is None else found) - noise
        return np.where((times <= start)[:, None], np.minimum(found, 0.0), found) if leaving else found

    at_points = values(points_within(start, end), known)
    sizes = np.abs(_TO_CHEBYSHEV @ (at_points + near))
    middle = _TO_CHEBYSHEV[0] @ (at_points + near)
    below = middle + sizes[1:].sum(axis=0) + 10 * sizes[-2:].sum(axis=0) < 0
    nearly = np.broadcast_to(near, below.shape)
    rises, crests = list[tuple[float, int]](), list[float]()
    for number in np.flatnonzero(np.logical_not(below)).tolist():

        def alone(times: FloatArray, number: int = number) -> FloatArray:
            return values(times)[:, number]

        rise = first_rise(alone, start, end)
        if rise is not None:
            rises.append((rise, number))
        if grazes is not None and nearly[number] and (crest := graze(alone, start, end, nearly[number])) is not None:
            crests.append(crest if rise is None else min(rise, crest))
    span = 1e-4 * (end - start)
    if grazes is not None:  # after a rise the motion is another; a joint that rubs turns at its crest
        grazes += [crest for crest in crests if not rises or crest <= min(rises)[0] + span]
    if not rises:
        return None
    time, number = min(rises)
    for _ in range(4):
        low, value, high = guards(np.array([time - span, time, time + span]))[:, number]
        slope = float(high - low) / (2 * span)
        better = time - float(value) / slope if slope > 0 else time
        if not start - span <= better <= end + span or abs(better - time) > 0.1 * (end - start):
            break  # a crest that only touches zero has no slope to go by
        moved, time = abs(better - time), better
        if moved <= 2 * np.spacing(time):
            break
    return time, number


def _one(values: Callable[[float], FloatArray], number: int, times: FloatArray) -> FloatArray:
    """Values of one function at some times."""
    return np.array([values(float(t))[number] for t in times])


def locate_rise(
    solver: Any,
    guards: Guards,
    noise: FloatArray | float = 0.0,
    leaving: bool = False,
    near: FloatArray | float = 0.0,
    grazes: list[float] | None = None,
) -> Rise | None:
    """First rise of a guard through zero in the last step, even if it falls again in that step; None: there is none.

    The dense output is less accurate than a step: it gives a first guess, which Newton's method refines with states
    integrated afresh from the start of the step.

    Args:
        solver: after a step.
        guards: state -> values, shape (guards,).
        noise: a guard counts as risen when it exceeds this.
        leaving: True if guards that are positive at the start of the step count as zero there.
        near: distance from zero of each guard's maximum below which a zero is uncertain; 0: never.
        grazes: list to which the times of these crests are appended [s].
    """
    dense, start, end = solver.dense_output(), float(solver.t_old), float(solver.t)
    known: dict[float, FloatArray] = {}

    def at(time: float) -> FloatArray:
        if time not in known:
            values = guards(dense(time)) - noise
            known[time] = np.minimum(values, 0.0) if leaving and time <= start else values
        return known[time]

    rises, crests = list[tuple[float, int]](), list[float]()
    below = stays_negative(lambda times: np.array([at(float(t)) + near for t in times]), start, end)
    nearly = np.broadcast_to(near, np.shape(below))
    for number in np.flatnonzero(np.logical_not(below)).tolist():
        own = partial(_one, at, number)
        rise = first_rise(own, start, end)
        if rise is not None:
            rises.append((rise, number))
        if grazes is not None and nearly[number] and (crest := graze(own, start, end, nearly[number])) is not None:
            crests.append(crest if rise is None else min(rise, crest))
    span = width = 1e-4 * (end - start)
    if grazes is not None:  # after a rise the motion is another; a joint that rubs turns at its crest
        grazes += [crest for crest in crests if not rises or crest <= min(rises)[0] + span]
    if not rises:
        return None
    time, number = min(rises)
    state = inside_last_step(solver, time)
    for _ in range(4):
        rates = solver.fun(time, state)
        slope = float(guards(state + span * rates)[number] - guards(state - span * rates)[number]) / (2 * span)
        better = time - float(guards(state)[number]) / slope if slope > 0 else time
        if not start - span <= better <= end + span or abs(better - time) > 0.1 * (end - start):
            break  # a crest that only touches zero has no slope to go by
        width = abs(better - time)
        if width <= 2 * np.spacing(time):
            break
        time, state = better, inside_last_step(solver, better)
    return Rise(time, max(width, 2 * float(np.spacing(time))), state, number)
