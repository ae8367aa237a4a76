"""Two independent routes to rolling without slip, both integrated at tight tolerance.

* :func:`reduced`: five states (u, u̇, ω1) on the surface's parametrisation, reactions eliminated by hand
  (:mod:`proofroll.elements.ball_on_surface.rolling_equations`).
* :func:`unreduced`: nine states (p, v, ω) in the world, reactions from a linear system, and the surface only through
  its signed distance.

Neither stops where rolling resistance brings a ball to rest; that case belongs to :mod:`truth.stick_slip`.
"""

import itertools
import math
from collections.abc import Callable

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.elements.ball_on_surface.mechanics import newton_euler
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.rolling_equations import placed, reduced_rates, start

# The tightest relative tolerance that scipy accepts is 100 machine epsilons.
_RTOL = 100 * np.finfo(float).eps
# Absolute tolerance relative to the natural size of each state: the round-off where a state passes through zero.
_ROUND_OFF = 1e-15


def reduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion at rising times [s] by the reduced equations.

    Raises:
        Diverged: the integration fails.
    """
    length, speed, spin = _sizes(body)
    per_metre = 1 / np.array(body.surface.length_scales)
    scales = np.array([*(length * per_metre), *(speed * per_metre), spin])
    states = _integrate(lambda x: reduced_rates(body, x)[0], scales, start(body), times)
    evaluated = [reduced_rates(body, x) for x in states]
    v, force = (np.array([item[i] for item in evaluated]) for i in (1, 2))
    return BallMotion(*placed(body, states, v), force, "reduced equations, DOP853")


def unreduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion at rising times [s] by Newton-Euler in the world with all constraint forces.

    Raises:
        Diverged: the integration fails.
    """

    def rates(x: FloatArray) -> FloatArray:
        acceleration, w_rate, _ = newton_euler(body, x[:3], x[3:6], x[6:])
        return np.concatenate([x[3:6], acceleration, w_rate])

    states = _integrate(rates, np.repeat(_sizes(body), 3), np.concatenate([body.p0, body.v0, body.w0]), times)
    p, v, w = states[:, :3], states[:, 3:6], states[:, 6:]
    force = np.array([newton_euler(body, *x)[2] for x in zip(p, v, w, strict=True)])
    return BallMotion(p, v, w, force, "unreduced Newton-Euler, DOP853")


def _sizes(body: RollingBall) -> tuple[float, float, float]:
    """Natural length [m], speed [m/s] and spin [rad/s] of the motion, none of them zero."""
    a = body.ball.radius
    speed = math.sqrt(a * float(np.linalg.norm(body.gravity))) + float(np.linalg.norm(body.v0))
    speed = speed + a * float(np.linalg.norm(body.w0)) or 1.0
    return a, speed, speed / a


def _integrate(
    rates: Callable[[FloatArray], FloatArray], scales: FloatArray, x: FloatArray, times: FloatArray
) -> FloatArray:
    """States at the times, shape (n, k), each at the end of a step: the dense output of DOP853 has a lower order."""
    from scipy.integrate import DOP853

    states, step = [x], math.inf
    for t, until in itertools.pairwise(times.tolist()):
        first = min(step, until - t)
        solver = DOP853(lambda _, y: rates(y), t, x, until, rtol=_RTOL, atol=_ROUND_OFF * scales, first_step=first)
        while solver.status == "running":
            message = solver.step()
            if message is not None:
                raise Diverged(f"the truth could not be integrated past {solver.t:g} s: {message}")
            step = max(solver.step_size, 1e-3 * (until - t))
        x = solver.y
        states.append(x)
    return np.array(states)
