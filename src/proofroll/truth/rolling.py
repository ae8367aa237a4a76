"""Two independent routes to rolling without slip, both integrated at tight tolerance.

* :func:`reduced`: five states (u, u̇, ω1) on the surface's parametrisation, reactions eliminated by hand
  (:mod:`proofroll.rolling_equations`).
* :func:`unreduced`: nine states (p, v, ω) in the world, reactions from a linear system, and the surface only through
  its signed distance.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import DOP853

from proofroll.errors import Diverged
from proofroll.mechanics import newton_euler
from proofroll.motion import Motion
from proofroll.rolling_equations import placed, reduced_rates, start
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray

# The tightest relative tolerance that scipy accepts is 100 machine epsilons.
_RTOL = 100 * np.finfo(float).eps


def reduced(body: RollingBall, times: FloatArray) -> Motion:
    """The reduced equations at tight tolerance."""
    states = _integrate(lambda x: reduced_rates(body, x)[0], start(body), times)
    evaluated = [reduced_rates(body, x) for x in states]
    v, force = (np.array([item[i] for item in evaluated]) for i in (1, 2))
    return Motion(*placed(body, states, v), force, "reduced equations, DOP853")


def unreduced(body: RollingBall, times: FloatArray) -> Motion:
    """Newton-Euler in the world with all constraint forces, at tight tolerance."""

    def rates(x: FloatArray) -> FloatArray:
        acceleration, w_rate, _ = newton_euler(body, x[:3], x[3:6], x[6:])
        return np.concatenate([x[3:6], acceleration, w_rate])

    states = _integrate(rates, np.concatenate([body.p0, body.v0, body.w0]), times)
    p, v, w = states[:, :3], states[:, 3:6], states[:, 6:]
    force = np.array([newton_euler(body, *x)[2] for x in zip(p, v, w, strict=True)])
    return Motion(p, v, w, force, "unreduced Newton-Euler, DOP853")


def _integrate(rates: Callable[[FloatArray], FloatArray], start: FloatArray, times: FloatArray) -> FloatArray:
    """States at ``times``, each reached by a step that ends there: the dense output of DOP853 has a lower order."""
    states = np.empty((len(times), len(start)))
    states[0] = start
    step = None
    for index in range(1, len(times)):
        span = times[index] - times[index - 1]
        solver = DOP853(
            lambda _, x: rates(x),
            times[index - 1],
            states[index - 1],
            times[index],
            rtol=_RTOL,
            atol=1e-15,
            first_step=None if step is None else min(step, span),
        )
        while solver.status == "running":
            message = solver.step()
            if message is not None:
                raise Diverged(f"the truth could not be integrated past {solver.t:g} s: {message}")
            if solver.status == "running" and solver.step_size < 1e-12 * span:
                raise Diverged(
                    f"the ball comes to rest at {solver.t:g} s, where rolling resistance has no direction; "
                    "with a finite mu_static, however large, the truth goes on past that"
                )
            step = max(solver.step_size, 1e-3 * span)
        states[index] = solver.y
    return states
