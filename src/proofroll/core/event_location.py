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
# Values between the points, of a polynomial through them and of its slope, and the factor by which half the spread of
# all values is larger at most than that of these (H. Ehlich, K. Zeller, Mathematische Zeitschrift 86, 1964).
_DENSE = 8 * _POINTS
_TO_DENSE = (chebyshev.chebvander(chebyshev.chebpts2(_DENSE + 1), _POINTS - 1) @ _TO_CHEBYSHEV).T
_TO_SLOPES = (chebyshev.chebvander(chebyshev.chebpts2(_DENSE + 1), _POINTS - 2) @ chebyshev.chebder(_TO_CHEBYSHEV)).T
_LAST = _TO_CHEBYSHEV[-2:].T
_WIDER = 1 / np.cos(np.pi / 2 * _POINTS / _DENSE)
# Last terms of a polynomial, relative to its values, that are round-off; how often a step is halved to get there.
_RESOLVED, _HALVINGS = 1e-14, 6
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


def _highest(dense: FloatArray) -> FloatArray:
    """Upper bounds of polynomials from their values at the dense points, (functions, points)."""
    top, bottom = dense.max(axis=1), dense.min(axis=1)
    return np.asarray(top + (_WIDER - 1) / 2 * (top - bottom))


def locate_rise_within(
    guards: Callable[[FloatArray], FloatArray],
    start: float,
    end: float,
    noise: FloatArray | float = 0.0,
    leaving: bool = False,
    near: FloatArray | float = 0.0,
    grazes: list[float] | None = None,
    guards_at_points: FloatArray | None = None,
    halvings: int = _HALVINGS,
) -> tuple[float, int] | None:
    """Time [s] and index of the first rise of a guard in a step whose dense output is as accurate as the step.

    A step in which some guard is no polynomial is halved: of a flight the series ends, and its step may be of any
    length, while the distance from a curved wall has none.

    Args:
        guards: of times, shape (times, guards); accurate within the whole step.
        start: of the step [s].
        end: of the step [s].
        noise: see :func:`locate_rise`, as for the arguments that follow.
        leaving: see there.
        near: see there.
        grazes: see there.
        guards_at_points: values of the guards at :func:`points_within`; None: they are evaluated.
        halvings: largest number of times that the step is halved.
    """

    def values(times: FloatArray, guard_values: FloatArray | None = None) -> FloatArray:
        guard_values = (guards(times) if guard_values is None else guard_values) - noise
        return (
            np.where((times <= start)[:, None], np.minimum(guard_values, 0.0), guard_values)
            if leaving
            else guard_values
        )

    at_points = values(points_within(start, end), guards_at_points)
    left_out = 10 * np.abs(at_points.T @ _LAST).sum(axis=1)
    below = _highest(at_points.T @ _TO_DENSE) + near + left_out < 0
    if below.all():
        return None
    below |= (at_points[0] <= 0) & (_highest(at_points.T @ _TO_SLOPES) + _POINTS**2 * left_out < 0)
    if halvings and np.any(~below & (left_out > _RESOLVED * np.abs(at_points).max(axis=0))):
        middle = (start + end) / 2
        rest = near, grazes, None, halvings - 1
        earliest = locate_rise_within(guards, start, middle, noise, leaving, *rest)
        return earliest or locate_rise_within(guards, middle, end, noise, False, *rest)
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
    dense: Callable[[Any], Any] | None = None,
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
        dense: dense output of the step; None: it is made here.
    """
    dense = solver.dense_output() if dense is None else dense
    start, end = float(solver.t_old), float(solver.t)
    guards_at: dict[float, FloatArray] = {}

    def at(time: float) -> FloatArray:
        if time not in guards_at:
            values = guards(dense(time)) - noise
            guards_at[time] = np.minimum(values, 0.0) if leaving and time <= start else values
        return guards_at[time]

    rises, crests = list[tuple[float, int]](), list[float]()
    below = stays_negative(lambda times: np.array([at(float(t)) + near for t in times]), start, end)
    nearly = np.broadcast_to(near, np.shape(below))
    for number in np.flatnonzero(np.logical_not(below)).tolist():
        guard = partial(_one, at, number)
        rise = first_rise(guard, start, end)
        if rise is not None:
            rises.append((rise, number))
        if grazes is not None and nearly[number] and (crest := graze(guard, start, end, nearly[number])) is not None:
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
