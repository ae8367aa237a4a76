"""Two independent routes to rolling without slip, both integrated at tight tolerance.

* :func:`reduced`: five states (u, u̇, ω1) on the surface's parametrisation, reactions eliminated by hand.
* :func:`unreduced`: nine states (p, v, ω) in the world, reactions from a linear system, and the surface only through
  its signed distance.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import DOP853

from proofroll.errors import Diverged
from proofroll.mechanics import newton_euler, resistance_moment
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray
from proofroll.truth.motion import Motion

# The tightest relative tolerance that scipy accepts is 100 machine epsilons.
_RTOL = 100 * np.finfo(float).eps


def reduced_rates(body: RollingBall, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rates of (u, u̇, ω1), shape (5,), and velocity and force in the world, shape (3,).

    With κ = J/ma² the tangential part of Newton-Euler after eliminating the friction reads
    (1 + κ) v̇ = g - κ a ω1 e1 × ė1 + e1 × M / (m a), and ω̇1 = ω · ė1.
    """
    a, m, kappa, f = body.ball.radius, body.ball.mass, body.ball.inertia_ratio, body.contact.rolling_resistance
    u, udot, spin = state[:2], state[2:4], state[4]
    surface = body.surface
    frame, tangents = surface.frame(u), surface.tangents(u)
    e1, in_plane = frame[:, 0], frame[:, 1:]
    curving = surface.second(u) @ udot @ udot
    v = tangents @ udot
    # ė1 · t = -e1 · ṫ for every tangent t: the shape operator from the second derivatives
    e1_rate = -np.linalg.pinv(tangents).T @ (e1 @ (surface.second(u) @ udot))
    N = m * (e1_rate @ v + e1 @ body.gravity)
    drive = body.gravity - kappa * a * spin * np.cross(e1, e1_rate)
    if f:
        drive = drive + np.cross(e1, resistance_moment(f, N, e1, v)) / (m * a)
    tangential = in_plane @ (in_plane.T @ drive) / (1 + kappa)
    acceleration = tangential - e1 * (e1_rate @ v)
    uddot = np.linalg.pinv(tangents) @ (tangential - curving)
    spin_rate = -np.cross(e1, v) @ e1_rate / a
    return np.concatenate([udot, uddot, [spin_rate]]), v, m * (acceleration - body.gravity)


def reduced(body: RollingBall, times: FloatArray) -> Motion:
    """The reduced equations at tight tolerance."""
    start = np.concatenate([body.u0, body.udot0, [body.w0 @ body.surface.normal(body.p0)]])
    states = _integrate(lambda x: reduced_rates(body, x)[0], start, times)
    evaluated = [reduced_rates(body, x) for x in states]
    v = np.array([item[1] for item in evaluated])
    e1 = body.surface.frame(states[:, :2])[..., 0]
    w = states[:, 4:] * e1 - np.cross(e1, v) / body.ball.radius
    force = np.array([item[2] for item in evaluated])
    return Motion(body.surface.position(states[:, :2]), v, w, force, "reduced equations, DOP853")


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
