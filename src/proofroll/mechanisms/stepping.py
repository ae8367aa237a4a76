"""DOP853 that lands on given times and corrects the state after each step."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.integrate import DOP853

from proofroll.core.errors import Diverged
from proofroll.mechanisms.rotations import Array

_LEAST_RELATIVE = 2.3e-14  # scipy's own least, 100 times the spacing of doubles


def integrated(
    rate: Callable[[float, Array], Array],
    start: Array,
    times: Array,
    tolerance: float,
    corrected: Callable[[Array], Array] | None = None,
    most_steps: int = 200_000,
) -> Iterator[Array]:
    """The state at each time; the solver steps exactly onto it, for its interpolation is of lower order.

    Args:
        rate: right-hand side.
        start: state at time 0.
        times: growing, s; the first may be 0.
        tolerance: absolute and relative, of each step.
        corrected: puts a state back on its constraints; applied after every step.
        most_steps: that the whole way may take.

    Raises:
        Diverged: the steps become too small or too many, or the state is not finite.
    """
    # time scipy.integrate needs an end; it is moved from sample to sample, so that the step size survives
    solver = DOP853(rate, 0.0, start, float(times[-1]) or 1.0, rtol=max(tolerance, _LEAST_RELATIVE), atol=tolerance)
    steps = 0
    for time in times:
        if time > solver.t:
            solver.t_bound, solver.status = float(time), "running"
        while solver.t < time:
            usual = solver.h_abs
            message = solver.step()
            steps += 1
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                raise Diverged(f"DOP853 stopped at t = {solver.t:.6g} s: {message or 'the state is not finite'}")
            if steps > most_steps:
                raise Diverged(f"DOP853 needs more than {most_steps} steps; it reached t = {solver.t:.6g} s")
            if solver.status == "finished":
                solver.h_abs = max(solver.h_abs, usual)
            if corrected is not None:
                solver.y = corrected(solver.y)
                solver.f = rate(solver.t, solver.y)
        yield solver.y.copy()
