"""Steps of scipy and of Runge and Kutta."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import DOP853

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged


def dop853(solver: DOP853, times: FloatArray, accepted: Callable[[DOP853, float], None]) -> None:
    """Steps, one of them ending at each time; ``accepted`` may change the state after each of them."""
    for t in times[1:].tolist():
        solver.t_bound, solver.status = t, "running"
        while solver.status == "running":
            wanted = solver.h_abs
            if solver.step() is not None:
                raise Diverged("the step size fell to nothing")
            if solver.t == t:
                solver.h_abs = max(wanted, solver.h_abs)
            accepted(solver, t)


def rk4(
    rates: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    times: FloatArray,
    h: float,
    after: Callable[[FloatArray], FloatArray] | None,
) -> FloatArray:
    """State at the last time by steps of the classical method, each followed by ``after``."""
    for interval in np.diff(times).tolist():
        for _ in range(round(interval / h)):
            k1 = rates(y)
            k2 = rates(y + h / 2 * k1)
            k3 = rates(y + h / 2 * k2)
            y = y + h / 6 * (k1 + 2 * (k2 + k3) + rates(y + h * k3))
            if after is not None:
                y = after(y)
            if not np.isfinite(y.sum()):
                raise Diverged("the state is not finite")
    return y
