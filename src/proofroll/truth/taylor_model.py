"""Stick and slip of a ball on a cylinder or plane as compiled Taylor integrators (heyoka).

Surfaces are those along which gravity turns with the arc length q and which bend only that way: curvature k = 1/c on
a cylinder, 0 on a plane. State: arc length q and height h [m], velocities v2, v3 of the centre [m/s], ω1 [rad/s]; all
forces are divided by the mass. With κ = J/(m a²), A = (1 + κ)/κ and the drive

    b = g_t + a ω1 e1 × ė1 + (f N / (κ a)) v/V

the slip velocity u obeys u̇ = A F + b, whether the ball slips (F = -μk N u/|u|) or sticks (F = -b/A).
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from proofroll.surfaces import FloatArray

# Order of the run-time parameters of every integrator.
# Functions and integrators take as many of them as they use; those that few use stand last.
PARAMETERS = ("curvature", "g_x", "g_y", "g_z", "radius", "kappa", "f", "mu_k", "mu_s", "limit", "t_end")


class Function:
    """A compiled function of states, shape (k,) or (k, n), and as many of the parameters as it uses."""

    def __init__(self, outputs: Sequence[Any], variables: Sequence[Any]) -> None:
        import heyoka as hy

        self._call = hy.cfunc(list(outputs), list(variables))
        names = [str(par) for output in outputs for par in hy.get_params(output)]
        self._count = 1 + max(int(name.strip("par[]")) for name in names)

    def __call__(self, states: FloatArray, pars: Sequence[float]) -> FloatArray:
        """Values, shape (outputs,) or (outputs, n)."""
        used = np.asarray(pars[: self._count], dtype=np.float64)
        if states.ndim == 2:
            used = np.repeat(used[:, None], states.shape[1], axis=1)
        return np.asarray(self._call(np.ascontiguousarray(states), pars=used), dtype=np.float64)


@dataclass
class Model:
    """Compiled integrators; each holds a state and must not be shared between threads.

    Attributes:
        stick: (q, h, v2, v3, ω1) against t; stops where the needed friction leaves the static cone.
        creep: (q, h, v2, v3, ω1, |u|) against t with the direction of slip slaved to the drive; stops where |u|
            reaches the parameter ``limit`` or comes back to zero.
        slip: (q, h, v2, v3, ω1, ln |u|, φ, t) against τ with dt = |u| dτ; stops where ln |u| falls to ``limit``, where
            t reaches ``t_end`` and where N reaches zero.
        drive: (q, h, v2, v3, ω1) -> b2, b3, |ḃ| while sticking, N; compiled function.
        rates: (q, h, v2, v3, ω1) -> their rates while sticking; compiled function.
        direction: (q, h, v2, v3, ω1, |u|) -> φ of the slaved slip; compiled function.
    """

    stick: Any
    creep: Any
    slip: Any
    drive: Function
    rates: Function
    direction: Function


_local = threading.local()


def model(resistance: bool, uniform: bool) -> Model:
    """The integrators, compiled once per thread.

    Args:
        resistance: with rolling resistance; without it the speed may pass through zero.
        uniform: gravity's local components do not change along the surface.
    """
    if not hasattr(_local, "models"):
        _local.models = cache(_compiled)
    compiled: Model = _local.models(resistance, uniform)
    return compiled


def _compiled(resistance: bool, uniform: bool) -> Model:
    import heyoka as hy

    q, h, v2, v3, w1, size, y, phi, t = hy.make_vars("q", "h", "v2", "v3", "w1", "size", "y", "phi", "t")
    k, gx, gy, gz, a, kappa, f, mu_k, mu_s, limit, t_end = (hy.par[i] for i in range(len(PARAMETERS)))
    angle = k * q
    g1, g2 = (gx, gy) if uniform else (gx * hy.cos(angle) + gy * hy.sin(angle), gy * hy.cos(angle) - gx * hy.sin(angle))
    N = g1 + k * v2**2
    A = (1.0 + kappa) / kappa
    per_speed = f * N / (kappa * a * hy.sqrt(v2**2 + v3**2)) if resistance else hy.expression(0.0)
    b2 = g2 + per_speed * v2
    b3 = gz + a * w1 * k * v2 + per_speed * v3
    available = A * mu_s * N
    outside = b2**2 + b3**2 - available**2

    def rates(F2: Any, F3: Any, u3: Any) -> list[tuple[Any, Any]]:
        return [(q, v2), (h, v3), (v2, g2 + F2), (v3, gz + F3), (w1, (v3 - u3) / a * k * v2)]

    def along(expression: Any, flow: list[tuple[Any, Any]]) -> Any:
        return hy.sum([hy.diff(expression, x) * x_rate for x, x_rate in flow])

    rolling = rates(-b2 / A, -b3 / A, 0.0)
    b_rate = (along(b2, rolling), along(b3, rolling))

    up, down = hy.event_direction.positive, hy.event_direction.negative

    def integrator(system: list[tuple[Any, Any]], events: list[Any]) -> Any:
        return hy.taylor_adaptive(system, [1.0] * len(system), t_events=events)

    # Slaved direction: on the slow solution the angle between u and b is δ = -|u| φ̇_b / (|b| + d|u|/dt).
    strength = hy.sqrt(b2**2 + b3**2)
    c, s = b2 / strength, b3 / strength
    leading = rates(-mu_k * N * c, -mu_k * N * s, size * s)
    turning = (b2 * along(b3, leading) - b3 * along(b2, leading)) / strength**2
    net = strength - A * mu_k * N
    delta = -size * turning / (strength + net)
    c_slip, s_slip = c - delta * s, s + delta * c  # δ² is below round-off where this is used
    creeping = [
        *rates(-mu_k * N * c_slip, -mu_k * N * s_slip, size * s_slip),
        (size, strength * hy.cos(delta) - A * mu_k * N),
    ]

    speed, cos, sin = hy.exp(y), hy.cos(phi), hy.sin(phi)
    slipping = [
        *((x, speed * x_rate) for x, x_rate in rates(-mu_k * N * cos, -mu_k * N * sin, speed * sin)),
        (y, b2 * cos + b3 * sin - A * mu_k * N),
        (phi, b3 * cos - b2 * sin),
        (t, speed),
    ]
    return Model(
        stick=integrator(rolling, [hy.t_event(outside, direction=up)]),
        creep=integrator(
            creeping, [hy.t_event(size - limit, direction=up), hy.t_event(size + 1e-10 * limit, direction=down)]
        ),
        slip=integrator(
            slipping,
            [hy.t_event(y - limit, direction=down), hy.t_event(t - t_end, direction=up), hy.t_event(N, direction=down)],
        ),
        drive=Function([b2, b3, hy.sqrt(b_rate[0] ** 2 + b_rate[1] ** 2), N], [q, h, v2, v3, w1]),
        direction=Function([hy.atan2(s_slip, c_slip)], [q, h, v2, v3, w1, size]),
        rates=Function([rate for _, rate in rolling], [q, h, v2, v3, w1]),
    )
