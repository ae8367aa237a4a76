"""Compiled Taylor integrators (heyoka) for stick and slip of a ball in an upright cylinder.

Equations, states and symbols are those of :mod:`proofroll.papers.blajer_2006.ball.compiled.rolling`.
"""

import threading
from dataclasses import dataclass
from functools import cache
from typing import Any

from proofroll.papers.blajer_2006.ball.compiled.rolling import PARAMETERS as SHARED
from proofroll.papers.blajer_2006.ball.compiled.rolling import Function, expressions

# Run-time parameters of all integrators and functions, in this order. Each uses a leading part of them.
PARAMETERS = (*SHARED, "mu_k", "mu_s", "limit", "t_end")


@dataclass
class TaylorModel:
    """Compiled integrators; each holds a state and must not be shared between threads.

    Attributes:
        stick: (q, h, v2, v3, ω1) over t; stops where the needed friction leaves the static cone.
        creep: (q, h, v2, v3, ω1, |u|) over t with the direction of slip slaved to the drive; stops where |u|
            reaches the parameter ``limit`` or returns to zero.
        slip: (q, h, v2, v3, ω1, ln |u|, φ, t) over τ with dt = |u| dτ; stops where ln |u| falls to ``limit``, where
            t reaches ``t_end``.
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


def model(resistance: bool) -> TaylorModel:
    """Integrators, compiled once per thread: with or without rolling resistance."""
    if not hasattr(_local, "models"):
        _local.models = cache(_compiled)
    compiled: TaylorModel = _local.models(resistance)
    return compiled


def _compiled(resistance: bool) -> TaylorModel:
    import heyoka as hy

    size, y, phi, t = hy.make_vars("size", "y", "phi", "t")
    mu_k, mu_s, limit, t_end = (hy.par[i] for i in range(len(SHARED), len(PARAMETERS)))
    equations = expressions(resistance)
    q, h, v2, v3, w1 = equations.state
    A, N, b2, b3 = equations.A, equations.N, equations.b2, equations.b3
    rates, derivative_along = equations.rates, equations.along
    rolling = equations.rolling()
    b_rate = (derivative_along(b2, rolling), derivative_along(b3, rolling))

    up, down = hy.event_direction.positive, hy.event_direction.negative

    def integrator(system: list[tuple[Any, Any]], events: list[Any]) -> Any:
        # opt_level=0: optimised code takes ten times as long to compile, which no run earns back
        return hy.taylor_adaptive(system, [1.0] * len(system), t_events=events, opt_level=0)

    # Slaved direction: the angle between u and b is δ = -|u| φ̇_b / (|b| + d|u|/dt).
    strength = hy.sqrt(b2**2 + b3**2)
    c, s = b2 / strength, b3 / strength
    leading = rates(-mu_k * N * c, -mu_k * N * s, size * s)
    turning = (b2 * derivative_along(b3, leading) - b3 * derivative_along(b2, leading)) / strength**2
    net = strength - A * mu_k * N
    delta = -size * turning / (strength + net)
    c_slip, s_slip = c - delta * s, s + delta * c  # δ² is below round-off before the handover
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
    return TaylorModel(
        stick=integrator(rolling, [hy.t_event(equations.excess(mu_s), direction=up)]),
        creep=integrator(
            creeping, [hy.t_event(size - limit, direction=up), hy.t_event(size + 1e-10 * limit, direction=down)]
        ),
        slip=integrator(
            slipping,
            [hy.t_event(y - limit, direction=down), hy.t_event(t - t_end, direction=up)],
        ),
        drive=Function([b2, b3, hy.sqrt(b_rate[0] ** 2 + b_rate[1] ** 2), N], [q, h, v2, v3, w1]),
        direction=Function([hy.atan2(s_slip, c_slip)], [q, h, v2, v3, w1, size]),
        rates=Function([rate for _, rate in rolling], [q, h, v2, v3, w1]),
    )
