"""Two independent routes to rolling without slip, both integrated at tight tolerance.

* :func:`reduced`: five states (u, u̇, ω1) on the surface's parametrisation, reactions eliminated by hand
  (:mod:`proofroll.elements.ball_on_surface.rolling_equations`).
* :func:`unreduced`: nine states (p, v, ω) in the world, reactions from a linear system, and the surface only through
  its signed distance.

A ball that rolling resistance brings to rest stays there or sets off down the slope (:mod:`ball_on_surface.resting`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.elements.ball_on_surface.mechanics import newton_euler
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.resting import setting_off, stands, stays
from proofroll.elements.ball_on_surface.rolling_equations import placed, reduced_rates, start

# The tightest relative tolerance that scipy accepts is 100 machine epsilons.
_RTOL = 100 * np.finfo(float).eps
# Absolute tolerance over the natural size of each state: round-off of a state that passes through zero.
_ROUND_OFF = 1e-15
_APPROACH = 0.6  # part of the time left until the centre stands still that one step may take
_STILL = 1e-9  # time left, relative to the pace of the motion, that is extrapolated
_STUCK = 1e-12  # part of the way to the next sample; a step that is shorter leads nowhere


@dataclass(frozen=True)
class _Equations:
    """One description of the motion.

    Attributes:
        rates: ẋ of a state x.
        scales: natural size of each component of x.
        world: p, v and v̇ of the centre in the state x, in the world.
        moving: the state x with another velocity of the centre, rolling.
    """

    rates: Callable[[FloatArray], FloatArray]
    scales: FloatArray
    world: Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
    moving: Callable[[FloatArray, FloatArray], FloatArray]


def reduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """The reduced equations at tight tolerance."""
    surface = body.surface

    def world(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        _, v, force = reduced_rates(body, x)
        return surface.position(x[:2]), v, force / body.ball.mass + body.gravity

    def moving(x: FloatArray, v: FloatArray) -> FloatArray:
        return np.concatenate([x[:2], np.linalg.pinv(surface.tangents(x[:2])) @ v, x[4:]])

    length, speed, spin = _sizes(body)
    per_metre = 1 / np.array(surface.length_scales)
    scales = np.array([*(length * per_metre), *(speed * per_metre), spin])
    equations = _Equations(lambda x: reduced_rates(body, x)[0], scales, world, moving)
    states, rests = _integrate(body, equations, start(body), times)
    evaluated = [reduced_rates(body, x) for x in states]
    v, force = (np.array([item[i] for item in evaluated]) for i in (1, 2))
    force[rests:] = -body.ball.mass * body.gravity
    return BallMotion(*placed(body, states, v), force, "reduced equations, DOP853")


def unreduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Newton-Euler in the world with all constraint forces, at tight tolerance."""

    def rates(x: FloatArray) -> FloatArray:
        acceleration, w_rate, _ = newton_euler(body, x[:3], x[3:6], x[6:])
        return np.concatenate([x[3:6], acceleration, w_rate])

    def world(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return x[:3], x[3:6], newton_euler(body, x[:3], x[3:6], x[6:])[0]

    def moving(x: FloatArray, v: FloatArray) -> FloatArray:
        e1 = body.surface.normal(x[:3])
        return np.concatenate([x[:3], v, (x[6:] @ e1) * e1 - np.cross(e1, v) / body.ball.radius])

    equations = _Equations(rates, np.repeat(_sizes(body), 3), world, moving)
    states, rests = _integrate(body, equations, np.concatenate([body.p0, body.v0, body.w0]), times)
    p, v, w = states[:, :3], states[:, 3:6], states[:, 6:]
    force = np.array([newton_euler(body, *x)[2] for x in zip(p, v, w, strict=True)])
    force[rests:] = -body.ball.mass * body.gravity
    return BallMotion(p, v, w, force, "unreduced Newton-Euler, DOP853")


def _sizes(body: RollingBall) -> tuple[float, float, float]:
    """Natural length [m], speed [m/s] and spin [rad/s] of the motion, none of them zero."""
    a = body.ball.radius
    speed = math.sqrt(a * float(np.linalg.norm(body.gravity))) + float(np.linalg.norm(body.v0))
    speed = speed + a * float(np.linalg.norm(body.w0)) or 1.0
    return a, speed, speed / a


def _integrate(body: RollingBall, equations: _Equations, x: FloatArray, times: FloatArray) -> tuple[FloatArray, int]:
    """States at ``times``, and the index from which the ball is at rest (their number: never).

    Each is reached by a step that ends there: the dense output of DOP853 has a lower order.
    """
    states = np.empty((len(times), len(x)))
    resisted = body.contact.rolling_resistance > 0
    length, speed, _ = _sizes(body)
    still = _STILL * length / speed
    atol, step = _ROUND_OFF * equations.scales, math.inf
    t = float(times[0])
    for index, until in enumerate(times.tolist()):
        while True:
            p, v, _ = equations.world(x)
            if stands(body, v):
                if stays(body, p):
                    states[index:] = x
                    return states, index
                x = equations.moving(x, setting_off(body, p))
            if not t < until:
                break
            span = until - t
            solver = _solver(equations, t, x, until, atol, min(step, span))
            while solver.status == "running":
                left = _until_halt(*equations.world(solver.y)[1:]) if resisted else math.inf
                if left < still and solver.t + left < until:
                    x, t = solver.y + left * solver.f, solver.t + left
                    x = equations.moving(x, np.zeros(3))
                    break
                solver.max_step = max(_APPROACH * left, 0.1 * still)
                message = solver.step()
                if message is not None or (solver.t < until and solver.step_size < _STUCK * min(span, still)):
                    raise Diverged(f"the truth could not be integrated past {solver.t:g} s: {message or 'no progress'}")
                step = max(solver.step_size, 1e-3 * span)
            else:
                x, t = solver.y, until
        states[index] = x
    return states, len(times)


def _solver(equations: _Equations, t: float, x: FloatArray, until: float, atol: FloatArray, first: float) -> Any:
    from scipy.integrate import DOP853

    return DOP853(
        lambda _, y: equations.rates(y),
        t,
        x,
        until,
        rtol=_RTOL,
        atol=atol,
        first_step=first if math.isfinite(first) else None,
    )


def _until_halt(v: FloatArray, acceleration: FloatArray) -> float:
    """Time until the centre stands still at the present rate [s]."""
    speed = float(np.linalg.norm(v))
    slowing = -float(v @ acceleration) / speed if speed > 0 else 0.0
    return speed / slowing if slowing > 0 else math.inf
