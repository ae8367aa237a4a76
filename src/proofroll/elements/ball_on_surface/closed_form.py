"""Closed forms of rolling without slip and without resistance."""

from __future__ import annotations

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.mechanics import wall_velocity
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.surfaces import Cylinder, Plane


def closed_form(body: RollingBall, times: FloatArray) -> BallMotion | None:
    """The closed form, or None where there is none (rolling resistance, a tilted cylinder)."""
    if body.contact.rolling_resistance > 0:
        return None
    if isinstance(body.surface, Plane):
        return _plane(body, times)
    if isinstance(body.surface, Cylinder) and not np.any(np.cross(body.gravity, body.surface.generators[1].axis)):
        return _vertical_cylinder(body, body.surface, times)
    return None


def _plane(body: RollingBall, t: FloatArray) -> BallMotion:
    """Uniform acceleration g_t / (1 + κ), κ = J/ma²: (5/7) g sin α for a homogeneous ball.

    On a turntable of the rate W, v̇ = g_t / (1 + κ) + W' n × v with W' = κ/(1 + κ) W (2/7 W) and the normal n: circles
    at the rate W', which drift where the table is tilted (Milne, Vectorial Mechanics, 1948).
    """
    frame = body.surface.frame(body.u0)
    e1, tangents = frame[:, 0], frame[:, 1:]
    acceleration = tangents @ (tangents.T @ body.gravity) / (1 + body.ball.inertia_ratio)
    if body.wall_rate is None:
        v = body.v0 + t[:, None] * acceleration
        p = body.p0 + t[:, None] * body.v0 + 0.5 * t[:, None] ** 2 * acceleration
        rates, route = np.broadcast_to(acceleration, p.shape), "closed form (uniform acceleration)"
    else:
        turning = body.ball.inertia_ratio / (1 + body.ball.inertia_ratio) * body.wall_rate
        drift = np.cross(turning, acceleration) / (turning @ turning)
        angle, circling = t[:, None] * float(turning @ -e1), body.v0 - drift
        sideways = np.cross(-e1, circling)
        v = drift + np.cos(angle) * circling + np.sin(angle) * sideways
        way = np.sin(angle) * circling + 2 * np.sin(angle / 2) ** 2 * sideways
        p = body.p0 + t[:, None] * drift + way / float(turning @ -e1)
        rates, route = acceleration + np.cross(turning, v), "closed form (circles of a turntable)"
    carried = wall_velocity(body, p, np.broadcast_to(e1, p.shape))
    w = (body.w0 @ e1) * e1 - np.cross(e1, v - carried) / body.ball.radius
    return BallMotion(p, v, w, body.ball.mass * (rates - body.gravity), route)


def _vertical_cylinder(body: RollingBall, surface: Cylinder, t: FloatArray) -> BallMotion:
    """γ̇ = Ω; z oscillates with ν = √(κ/(1+κ)) Ω, κ = J/ma² (Blajer 2006; ν = √(2/7) Ω for a homogeneous ball).

    Its only error is round-off of the phases, 4 ε νt of the amplitude of z and 4 ε Ωt of the radius of the path: 1e-8
    after a million oscillations.
    """
    a, m, c, kappa = body.ball.radius, body.ball.mass, surface.radius, body.ball.inertia_ratio
    axis = np.asarray(surface.generators[1].axis)
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
    return BallMotion(surface.position(u), v, w, force, "closed form (Blajer 2006)")
