"""Rolling without slip: closed forms, and five states (u, u̇, ω1) with the reactions eliminated by hand.

The truth's first route and the engine ``reduced`` both use this module, so that their agreement does not check these
equations. The truth's second route, which does not use them, does.
"""

import math

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion
from proofroll.papers.blajer_2006.ball.model import RollingBall


def start(body: RollingBall) -> FloatArray:
    """(u, u̇, ω1) at time 0, shape (5,)."""
    return np.concatenate([body.u0, body.udot0, [body.w0 @ body.surface.normal(body.p0)]])


def reduced_rates(body: RollingBall, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rates of (u, u̇, ω1), shape (5,), and velocity [m/s] and force [N] in the world, shape (3,).

    With κ = J/ma² the tangential part of Newton-Euler after eliminating the friction reads
    (1 + κ) v̇ = g - κ a ω1 e1 × ė1 + e1 × M / (m a), and ω̇1 = ω · ė1.
    """
    a, m, kappa, f = body.ball.radius, body.ball.mass, body.ball.inertia_ratio, body.contact.rolling_resistance
    u, spin = state[:2], float(state[4])
    frame, bending = body.surface.frame(u), body.surface.second(u) @ state[2:4]
    # Components along e1, e2, e3 as plain floats: for two or three numbers, arrays cost several times the arithmetic.
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
    speed = math.hypot(v2, v3)
    if f and speed:  # e1 × M = -f N v/V; at rest the moment is zero, as in resistance_moment
        resisted = f * N / (m * a)
        drive2, drive3 = drive2 - resisted * (v2 / speed), drive3 - resisted * (v3 / speed)
    tangential2, tangential3 = drive2 / (1 + kappa), drive3 / (1 + kappa)
    along2, along3 = (
        x - row[0] * udot1 - row[1] * udot2 for x, row in zip((tangential2, tangential3), curving, strict=True)
    )
    uddot1, uddot2 = (t3v * along2 - t2v * along3) / det, (t2u * along3 - t3u * along2) / det
    spin_rate = (v3 * r2 - v2 * r3) / a
    force = (m * (-inward - g1), m * (tangential2 - g2), m * (tangential3 - g3))
    rates = np.array([udot1, udot2, uddot1, uddot2, spin_rate])
    return rates, frame @ (0.0, v2, v3), frame @ force


def placed(body: RollingBall, states: FloatArray, v_WB: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centre p_WB [m], ``v_WB`` [m/s] and spin w_WB [rad/s] of states (u, u̇, ω1), shape (n, 5); each shape (n, 3)."""
    e1 = body.surface.frame(states[:, :2])[..., 0]
    p_WB = body.surface.position(states[:, :2])
    w_WB = states[:, 4:] * e1 - cross(e1, v_WB) / body.ball.radius
    return p_WB, v_WB, w_WB


def closed_form(body: RollingBall, times: FloatArray) -> BallMotion | None:
    """Closed form of the motion; None with rolling resistance."""
    if body.contact.rolling_resistance > 0:
        return None
    return _vertical_cylinder(body, times)


def _vertical_cylinder(body: RollingBall, t: FloatArray) -> BallMotion:
    """γ̇ = Ω; z oscillates with ν = √(κ/(1+κ)) Ω, κ = J/ma² (Blajer 2006; ν = √(2/7) Ω for a homogeneous ball).

    Its only error is round-off of the phases, 4 ε νt of the amplitude of z and 4 ε Ωt of the radius of the path: 1e-8
    after a million oscillations.
    """
    surface = body.surface
    a, m, c, kappa = body.ball.radius, body.ball.mass, surface.radius, body.ball.inertia_ratio
    axis = np.asarray(surface.axis)
    gravity = float(body.gravity @ axis)
    gamma0, z0 = body.u0
    omega, z_rate0 = body.udot0
    e1 = surface.frame(body.u0)[:, 0]
    spin0 = float(body.w0 @ e1)
    # z̈ = b - ν² (z - z0) with ω1 = ω1(0) + Ω (z - z0) / a
    b = (gravity - kappa * a * omega * spin0) / (1 + kappa)
    nu = np.sqrt(kappa / (1 + kappa)) * abs(omega)
    half = 0.5 * nu * t
    # 1 - cos νt = 2 sin² (νt/2) keeps all digits at small νt; sinc keeps them as ν → 0
    sinc = np.sinc(half / np.pi)
    z = z0 + 0.5 * b * (t * sinc) ** 2 + z_rate0 * t * np.sinc(nu * t / np.pi)
    z_rate = b * t * np.sinc(nu * t / np.pi) + z_rate0 * np.cos(nu * t)
    z_second = b - nu**2 * (z - z0)
    spin1 = spin0 + omega * (z - z0) / a
    u = np.stack([gamma0 + omega * t, z], axis=-1)
    frame = surface.frame(u)
    local_v = np.stack([np.zeros_like(t), np.full_like(t, c * omega), z_rate], axis=-1)
    local_w = np.stack([spin1, z_rate / a, np.full_like(t, -c * omega / a)], axis=-1)
    local_f = np.stack([np.full_like(t, -m * c * omega**2), np.zeros_like(t), m * (z_second - gravity)], axis=-1)
    v, w, force = (np.einsum("tij,tj->ti", frame, x) for x in (local_v, local_w, local_f))
    return BallMotion(p_WB=surface.position(u), v_WB=v, w_WB=w, force=force, route="closed form (Blajer 2006)")
