"""Single steps of DOP853 (scipy) that can be looked into, for our own integrators and for truths."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.crossing import first_rise, stays_negative
from proofroll.core.errors import Diverged

# Called after each step with its time and state; returns the state to go on from, the very same object if unchanged.
Accept = Callable[[float, FloatArray], FloatArray]
Guards = Callable[[FloatArray], FloatArray]

# scipy accepts no relative tolerance below 100 machine epsilons, which is its caution, not the method's limit.
TIGHTEST = 100 * float(np.finfo(float).eps)


class Rise(NamedTuple):
    """First rise of a guard through zero within a step.

    Attributes:
        time: [s].
        width: half the width of its bracket [s].
        state: there.
        guard: its number.
    """

    time: float
    width: float
    state: FloatArray
    guard: int


def solver_from(
    rates: Callable[[float, FloatArray], FloatArray],
    t: float,
    y: FloatArray,
    rtol: float,
    atol: FloatArray | float,
    first_step: float | None = None,
) -> Any:
    """A solver of scipy without an end, which :func:`controlled_step` moves."""
    from scipy.integrate import DOP853

    solver = DOP853(rates, t, y, math.inf, rtol=max(rtol, TIGHTEST), atol=atol, first_step=first_step)
    solver.rtol = rtol
    return solver


def go_on_from(solver: Any, y: FloatArray) -> None:
    """Lets a solver go on from a state: rates that open a step must belong to it, or the error control collapses."""
    if y is not solver.y:
        solver.y, solver.f = y, solver.fun(solver.t, y)


def controlled_step(solver: Any, accept: Accept | None, until: float, longest: float = math.inf) -> None:
    """One step of a solver of scipy, at most of a length [s] and at most to the time ``until`` [s].

    The step size that the error control wants survives a step that was shortened to end there.

    Raises:
        Diverged: no step is small enough.
    """
    solver.t_bound, solver.status, solver.max_step = until, "running", longest
    wanted = solver.h_abs
    if solver.step() is not None:
        raise Diverged(f"the step size fell to nothing at t = {solver.t:.6g} s")
    if solver.t == until:
        solver.h_abs = max(wanted, solver.h_abs)
    if accept is not None:
        go_on_from(solver, accept(float(solver.t), solver.y))


def corrected_by(corrected: Callable[[FloatArray], FloatArray]) -> Accept:
    """Acceptance that puts a state back on its constraints; where that fails the message has the time."""

    def accept(t: float, y: FloatArray) -> FloatArray:
        try:
            return corrected(y)
        except Diverged as stopped:
            raise Diverged(f"DOP853 stopped at t = {t:.6g} s: {stopped}") from None

    return accept


def inside_last_step(solver: Any, t: float) -> FloatArray:
    """The state at a time [s] within the last step, integrated from where that began; earlier, in a straight line.

    Raises:
        Diverged: no step is small enough.
    """
    return integrated_to(solver.fun, solver.t_old, solver.y_old, t, solver.rtol, solver.atol)


def integrated_to(
    rates: Callable[[float, FloatArray], FloatArray],
    start: float,
    y: FloatArray,
    t: float,
    rtol: float,
    atol: FloatArray | float,
) -> FloatArray:
    """The state at the end of a part of a step, which takes one step unless its error is too large.

    A guard that rose just before the step, by less than its round-off, is a moment before it: in a straight line.
    """
    if t <= start:
        return y if t == start else np.asarray(y + (t - start) * rates(start, y))
    part = solver_from(rates, start, y, rtol, atol, t - start)
    while part.t < t:
        controlled_step(part, None, t)
    return np.asarray(part.y)


def located(solver: Any, guards: Guards, noise: FloatArray | float = 0.0, leaving: bool = False) -> Rise | None:
    """First rise of a guard through zero in the last step of a solver, also under a crest; None: there is none.

    A dense output has fewer digits than a step: it tells about when, and Newton's method on states that are integrated
    afresh from the start of the step does the rest.

    Args:
        solver: after a step.
        guards: values of a state, shape (guards,).
        noise: by which guards must rise above zero to be seen.
        leaving: at the start of the step no guard has risen yet.
    """
    dense, start, end = solver.dense_output(), float(solver.t_old), float(solver.t)
    known: dict[float, FloatArray] = {}

    def at(time: float) -> FloatArray:
        if time not in known:
            values = guards(dense(time)) - noise
            known[time] = np.minimum(values, 0.0) if leaving and time <= start else values
        return known[time]

    rises = []
    below = stays_negative(lambda times: np.array([at(float(t)) for t in times]), start, end)
    for number in np.flatnonzero(np.logical_not(below)).tolist():
        rise = first_rise(lambda times, k=number: np.array([at(float(t))[k] for t in times]), start, end)  # type: ignore[misc]  # mypy cannot type a default
        if rise is not None:
            rises.append((rise, number))
    if not rises:
        return None
    (time, number), width = min(rises), 1e-4 * (end - start)
    span = width
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
