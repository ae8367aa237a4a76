"""Rolling without slip in five states (u, u̇, ω1) on a surface's parametrisation, reactions eliminated by hand.

The truth's first route and the engine ``reduced`` both rest on this module, and on :mod:`proofroll.closed_form`. So
their agreement says nothing about these equations: only the truth's second route, which knows neither, checks them.
"""

from __future__ import annotations

import numpy as np

from proofroll.mechanics import resistance_moment
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray


def start(body: RollingBall) -> FloatArray:
    """(u, u̇, ω1) at time 0, shape (5,)."""
    return np.concatenate([body.u0, body.udot0, [body.w0 @ body.surface.normal(body.p0)]])


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


def placed(body: RollingBall, states: FloatArray, v_WB: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """p_WB [m], v_WB [m/s] and w_WB [rad/s] of states (u, u̇, ω1), shape (n, 5), with ``v_WB``; each shape (n, 3)."""
    e1 = body.surface.frame(states[:, :2])[..., 0]
    w_WB = states[:, 4:] * e1 - np.cross(e1, v_WB) / body.ball.radius
    return body.surface.position(states[:, :2]), v_WB, w_WB
