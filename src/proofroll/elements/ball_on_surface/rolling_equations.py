"""Rolling without slip in five states (u, u̇, ω1) on a surface's parametrisation, reactions eliminated by hand.

The truth's first route and the engine ``reduced`` both rest on this module, and on :mod:`closed_form`. So their
agreement says nothing about these equations: only the truth's second route, which knows neither, checks them.
"""

from __future__ import annotations

import math

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.elements.ball_on_surface.mechanics import wall_velocity
from proofroll.elements.ball_on_surface.model import RollingBall


def start(body: RollingBall) -> FloatArray:
    """(u, u̇, ω1) at time 0, shape (5,)."""
    return np.concatenate([body.u0, body.udot0, [body.w0 @ body.surface.normal(body.p0)]])


def reduced_rates(body: RollingBall, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rates of (u, u̇, ω1), shape (5,), and velocity and force in the world, shape (3,).

    With κ = J/ma² the tangential part of Newton-Euler after eliminating the friction reads
    (1 + κ) v̇ = g - κ a ω1 e1 × ė1 + e1 × M / (m a), and ω̇1 = ω · ė1. A wall that turns at the rate W adds κ ẇ, for the
    velocity w = W × (p + a e1) of its point at the contact, and in ω the ball rolls with v - w.
    """
    a, m, kappa, f = body.ball.radius, body.ball.mass, body.ball.inertia_ratio, body.contact.rolling_resistance
    u, spin = state[:2], float(state[4])
    frame, bending = body.surface.frame(u), body.surface.second(u) @ state[2:4]
    # Along e1, e2, e3 as plain floats: for vectors of two or three numbers arrays cost several times the arithmetic.
    udot1, udot2 = state[2:4].tolist()
    _, (t2u, t2v), (t3u, t3v) = (frame.T @ body.surface.tangents(u)).tolist()
    (bend_u, bend_v), *curving = (frame.T @ bending).tolist()
    g1, g2, g3 = (body.gravity @ frame).tolist()
    det = t2u * t3v - t2v * t3u
    v2, v3 = t2u * udot1 + t2v * udot2, t3u * udot1 + t3v * udot2
    # ė1 · t = -e1 · ṫ for every tangent t: the shape operator from the second derivatives
    r2, r3 = (bend_v * t3u - bend_u * t3v) / det, (bend_u * t2v - bend_v * t2u) / det
    inward = r2 * v2 + r3 * v3
    N = m * (inward + g1)
    drive2, drive3 = g2 + kappa * a * spin * r3, g3 - kappa * a * spin * r2
    w2 = w3 = 0.0
    if body.wall_rate is not None:
        e1, e1_rate = frame[:, 0], frame[:, 1:] @ (r2, r3)
        _, w2, w3 = (cross(body.wall_rate, body.surface.position(u) + a * e1) @ frame).tolist()
        _, gain2, gain3 = (cross(body.wall_rate, frame[:, 1:] @ (v2, v3) + a * e1_rate) @ frame).tolist()
        drive2, drive3 = drive2 + kappa * gain2, drive3 + kappa * gain3
    speed = math.hypot(v2, v3)
    if f and speed:  # e1 × M = -f N v/V; at rest the moment is zero, as in resistance_moment
        held = f * N / (m * a)
        drive2, drive3 = drive2 - held * (v2 / speed), drive3 - held * (v3 / speed)
    tangential2, tangential3 = drive2 / (1 + kappa), drive3 / (1 + kappa)
    along2, along3 = (
        x - row[0] * udot1 - row[1] * udot2 for x, row in zip((tangential2, tangential3), curving, strict=True)
    )
    uddot1, uddot2 = (t3v * along2 - t2v * along3) / det, (t2u * along3 - t3u * along2) / det
    spin_rate = ((v3 - w3) * r2 - (v2 - w2) * r3) / a
    force = (m * (-inward - g1), m * (tangential2 - g2), m * (tangential3 - g3))
    rates = np.array([udot1, udot2, uddot1, uddot2, spin_rate])
    return rates, frame @ (0.0, v2, v3), frame @ force


def placed(body: RollingBall, states: FloatArray, v_WB: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """p_WB [m], v_WB [m/s] and w_WB [rad/s] of states (u, u̇, ω1), shape (n, 5), with ``v_WB``; each shape (n, 3)."""
    e1 = body.surface.frame(states[:, :2])[..., 0]
    p_WB = body.surface.position(states[:, :2])
    w_WB = states[:, 4:] * e1 - cross(e1, v_WB - wall_velocity(body, p_WB, e1)) / body.ball.radius
    return p_WB, v_WB, w_WB
