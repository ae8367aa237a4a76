"""Steps of scipy's DOP853, with the state at any time inside a step, and at samples; for integrators and truths."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.stalling import StepCount, StepWatch

# Called after each step with its time and state; returns the state to go on from, the very same object if unchanged.
Accept = Callable[[float, FloatArray], FloatArray]

# Smallest relative tolerance that scipy accepts; the method itself could go lower.
TIGHTEST = 100 * float(np.finfo(float).eps)
# Distance from a failure of the rates, relative to the time, up to which steps are halved to come nearer to it.
NEAREST = 1e-9


def solver_from(
    rates: Callable[[float, FloatArray], FloatArray],
    t: float,
    y: FloatArray,
    rtol: float,
    atol: FloatArray | float,
    first_step: float | None = None,
) -> Any:
    """Solver of scipy without an end time, to be moved by :func:`controlled_step`; it may be tighter than TIGHTEST."""
    from scipy.integrate import DOP853

    solver = DOP853(rates, t, y, math.inf, rtol=max(rtol, TIGHTEST), atol=atol, first_step=first_step)
    solver.rtol = rtol
    return solver


def go_on_from(solver: Any, y: FloatArray) -> None:
    """Sets the state of a solver and the rates that belong to it; with stale rates the error control collapses."""
    if y is not solver.y:
        solver.y, solver.f = y, solver.fun(solver.t, y)


def controlled_step(solver: Any, accept: Accept | None, until: float, longest: float = math.inf) -> None:
    """One step of a solver of scipy.

    A step that is shortened to end at ``until`` does not shrink the size of the next one.

    Args:
        solver: of :func:`solver_from`.
        accept: called with time and state after the step; returns the state to go on from; None: the state stays.
        until: latest end of the step [s].
        longest: longest step [s].

    Raises:
        Diverged: no step is small enough.
    """
    solver.t_bound, solver.status, solver.max_step = until, "running", longest
    step_size = solver.h_abs
    if solver.step() is not None:
        raise Diverged(f"the step size fell to nothing at t = {solver.t:.6g} s")
    if solver.t == until:
        solver.h_abs = max(step_size, solver.h_abs)
    if accept is not None:
        go_on_from(solver, accept(float(solver.t), solver.y))


def corrected_by(corrected: Callable[[FloatArray], FloatArray]) -> Accept:
    """Function to call after each step (:data:`Accept`) that projects the state onto its constraints.

    If the projection fails, the error names the time.
    """

    def accept(t: float, y: FloatArray) -> FloatArray:
        try:
            return corrected(y)
        except Diverged as stopped:
            raise Diverged(f"DOP853 stopped at t = {t:.6g} s: {stopped}") from None

    return accept


def inside_last_step(solver: Any, t: float) -> FloatArray:
    """State at a time [s] within the last step, integrated from its start; before the start, extrapolated linearly.

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
    """State at time ``t`` [s], integrated from ``start`` [s] in one step unless its error is too large.

    A guard that rose just before the step, within round-off, gives a ``t`` before ``start``: it is extrapolated
    linearly.
    """
    if t <= start:
        return y if t == start else np.asarray(y + (t - start) * rates(start, y))
    part = solver_from(rates, start, y, rtol, atol, t - start)
    while part.t < t:
        controlled_step(part, None, t)
    return np.asarray(part.y)


def integrate(
    rate: Callable[[float, FloatArray], FloatArray],
    start: FloatArray,
    times: FloatArray,
    tolerance: float,
    corrected: Callable[[FloatArray], FloatArray] | None = None,
    least: FloatArray | None = None,
    first_step: float | None = None,
) -> Iterator[FloatArray]:
    """States at the times by DOP853; the solver steps exactly onto each time, for its interpolation is of lower order.

    The round-off of a step is added to the next step (W. Kahan, Comm. ACM 8, 1965, 40): otherwise a body that turns
    about its intermediate axis would lose ten times the digits.

    Args:
        rate: right-hand side.
        start: state at time 0.
        times: growing, s; the first may be 0.
        tolerance: absolute and relative, of each step.
        corrected: puts a state back on its constraints; applied after every step; None: it stays.
        least: absolute tolerance of each component; None: ``tolerance``.
        first_step: length of the first attempt [s]; None: chosen from the rates.

    Raises:
        Diverged: the steps become too small or too many, or the rates fail, at its ``time``.
    """
    solver = solver_from(rate, 0.0, start, tolerance, tolerance if least is None else least, first_step)
    watch, count, longest = StepWatch(), StepCount(0.0, float(times[-1])), math.inf
    lost, back = np.zeros_like(start), corrected_by(corrected or (lambda y: y))

    def accept(t: float, _: FloatArray) -> FloatArray:
        nonlocal lost
        moved = (t - solver.t_old) * (solver.K[:-1].T @ solver.B) + lost
        y = solver.y_old + moved
        lost = moved - (y - solver.y_old)
        return back(t, y)

    for time in times.tolist():
        while solver.t < time:
            begun = solver.t
            try:
                controlled_step(solver, accept, time, longest)
                watch.took(solver.t, solver.step_size, solver.t == time)
                count.took(solver.t)
            except Diverged as stopped:
                if solver.t > begun:  # the step itself succeeded
                    raise Diverged(str(stopped), solver.t) from None
                longest = min(solver.h_abs, longest, time - begun) / 2
                if longest <= NEAREST * begun or begun == 0.0:
                    raise Diverged(str(stopped), begun) from None
            else:
                longest *= 2.0
        yield solver.y.copy()
