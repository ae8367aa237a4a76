"""Two independent routes to rolling without slip, both integrated at tight tolerance.

* :func:`reduced`: five states (u, u̇, ω1) on the surface's parametrisation, reactions eliminated by hand
  (:mod:`proofroll.papers.blajer_2006.ball.rolling_equations`).
* :func:`unreduced`: nine states (p, v, ω) in the world, reactions from a linear system, and the surface only through
  its signed distance.
"""

import math
from collections.abc import Callable

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import TIGHTEST, integrate
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion, newton_euler
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.rolling_equations import placed, reduced_rates, start

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
    states = _integrated(lambda x: reduced_rates(body, x)[0], scales, start(body), times)
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

    states = _integrated(rates, np.repeat(_sizes(body), 3), np.concatenate([body.p0, body.v0, body.w0]), times)
    p, v, w = states[:, :3], states[:, 3:6], states[:, 6:]
    force = np.array([newton_euler(body, *x)[2] for x in zip(p, v, w, strict=True)])
    return BallMotion(p_WB=p, v_WB=v, w_WB=w, force=force, route="unreduced Newton-Euler, DOP853")


def _sizes(body: RollingBall) -> tuple[float, float, float]:
    """Natural length [m], speed [m/s] and spin [rad/s] of the motion, none of them zero."""
    a = body.ball.radius
    speed = math.sqrt(a * float(np.linalg.norm(body.gravity))) + float(np.linalg.norm(body.v0))
    speed = speed + a * float(np.linalg.norm(body.w0)) or 1.0
    return a, speed, speed / a


def _integrated(
    rates: Callable[[FloatArray], FloatArray], scales: FloatArray, x: FloatArray, times: FloatArray
) -> FloatArray:
    """States at the times, shape (n, k), from the state at the first one."""
    spans = times - times[0]
    longest = float(spans[1]) if len(spans) > 1 else None  # a step that reaches a point without curvature names it
    states = integrate(lambda _, y: rates(y), x, spans, TIGHTEST, least=_ROUND_OFF * scales, first_step=longest)
    return np.array(list(states))
