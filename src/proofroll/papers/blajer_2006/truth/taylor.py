"""Stick and slip by compiled Taylor series (heyoka): the fast first route."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.papers.blajer_2006.ball.compiled.rolling import PARAMETERS as SHARED
from proofroll.papers.blajer_2006.ball.compiled.rolling import Function, expressions, parameters, start
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion, world_motion
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.sliding import End, Sliding

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
        slip=integrator(slipping, [hy.t_event(y - limit, direction=down), hy.t_event(t - t_end, direction=up)]),
        drive=Function([b2, b3, hy.sqrt(b_rate[0] ** 2 + b_rate[1] ** 2), N], [q, h, v2, v3, w1]),
        direction=Function([hy.atan2(s_slip, c_slip)], [q, h, v2, v3, w1, size]),
        rates=Function([rate for _, rate in rolling], [q, h, v2, v3, w1]),
    )


# Reasons for an end, in the order of the integrators' events.
_STICK_ENDS = (End.CONE,)
_CREEP_ENDS = (End.GROWN, End.STILL)
_SLIP_ENDS = (End.STILL, End.TIME)
_LARGEST = 1e6  # largest friction coefficient: more than any motion needs, and its square still counts
_TIME_LIMIT = -(2**32) - 3  # heyoka's taylor_outcome.time_limit


class SlidingTaylor(Sliding):
    """Route in the local frame: arc length q, height h [m], v2, v3 [m/s], ω1 [rad/s]; see :class:`Sliding`."""

    name = "local frame with direction of slip, Taylor series"

    def __init__(self, body: RollingBall, handover: float = 1e-5) -> None:
        super().__init__(body, handover)
        contact = body.contact
        self._scales = np.array(body.surface.length_scales)
        self._A = (1 + body.ball.inertia_ratio) / body.ball.inertia_ratio
        self._pars = [*parameters(body), *(min(mu, _LARGEST) for mu in (contact.mu_kinetic, contact.mu_static))]
        self._model: TaylorModel = model(contact.rolling_resistance > 0)

    @override
    def start(self) -> FloatArray:
        return start(self._body)

    @override
    def friction(self, state: FloatArray) -> tuple[float, float]:  # times (1 + κ)/κ over the mass [m/s²]
        b2, b3, _, N = self._model.drive(state, self._pars)
        return float(np.hypot(b2, b3)), self._A * self._body.contact.mu_static * float(N)

    @override
    def rates(self, state: FloatArray) -> FloatArray:
        return self._model.rates(state, self._pars)

    def _stick(self, time: float, state: FloatArray, until: float) -> _Run:
        return _Run(self._model.stick, self._pars, _STICK_ENDS, time, state, until)

    def _grown(self, time: float, state: FloatArray, until: float) -> float:
        b2, b3, change, _ = self._model.drive(state, self._pars)
        strength = float(np.hypot(b2, b3))
        pace = min(strength / change if change > 0 else np.inf, until - time)
        return max(self._handover * strength * pace, np.finfo(float).tiny)

    def _creep(self, time: float, state: FloatArray, until: float, handover: float) -> _Run:
        return _Run(self._model.creep, [*self._pars, handover], _CREEP_ENDS, time, np.append(state, 0.0), until)

    def _slide(self, start_state: FloatArray, floor: float, until: float) -> _Run:
        return _Run(self._model.slip, [*self._pars, floor, until], _SLIP_ENDS, 0.0, start_state, np.inf)

    @override
    def _slaved(self, state: FloatArray) -> float:
        return float(self._model.direction(state, self._pars)[0])

    def _stood_still(self, last: FloatArray) -> FloatArray:
        b2, b3, _, N = self._model.drive(last[:5], self._pars)
        cos, sin = np.cos(last[6]), np.sin(last[6])
        mu = self._body.contact.mu_kinetic
        slowing = self._A * mu * N - b2 * cos - b3 * sin
        left = float(np.exp(last[5]) / slowing)
        # The rates of sticking, with the friction of sticking replaced by that of slipping
        rates = self.rates(last[:5])
        rates[2] += -mu * N * cos + b2 / self._A
        rates[3] += -mu * N * sin + b3 / self._A
        return np.array([*(last[:5] + left * rates), -np.inf, last[6], last[7] + left])

    def _motion(self, states: FloatArray) -> BallMotion:
        ball = self._body.ball
        b2, b3, _, N = self._model.drive(states.T, self._pars)
        return world_motion(
            self._body,
            states[:, :2] / self._scales,
            velocity=states[:, 2:4],
            spin=states[:, 4],
            friction=-ball.mass / self._A * np.stack([b2, b3], axis=-1),
            press=ball.mass * N,
            route=self.name,
        )


class _Run:
    """Run of a compiled integrator to ``until`` or the first event; repeated with dense output when first sampled.

    Implements :class:`.sliding.IntegratedRun`; ``ends`` gives the reason for each event of the integrator.
    """

    def __init__(
        self, integrator: Any, pars: list[float], ends: tuple[End, ...], time: float, state: FloatArray, until: float
    ) -> None:
        self._inputs = (integrator, pars, time, state, min(until, 1e300))
        self._series: Any = None
        self.end, self.last, self.why = time, state, End.TIME
        if until > time:
            code = self._again(dense=False)
            event = -code - 1 if -(2**31) < code < 0 else None  # terminal events are numbered -1, -2, …
            if (event is None and code != _TIME_LIMIT) or not np.all(np.isfinite(integrator.state)):
                raise Diverged("the Taylor series of stick and slip could not be continued")
            self.end, self.last = float(integrator.time), integrator.state.copy()
            self.why = End.TIME if event is None else ends[event]

    def _again(self, dense: bool) -> int:
        integrator, pars, time, state, until = self._inputs
        integrator.time = time
        integrator.pars[:] = pars[: len(integrator.pars)]
        integrator.state[:] = state
        integrator.reset_cooldowns()
        result = integrator.propagate_until(until, c_output=dense)
        self._series = result[4]
        return int(result[0])

    def at(self, places: FloatArray) -> FloatArray:
        """See :class:`proofroll.papers.blajer_2006.truth.sliding.IntegratedRun`."""
        if self._series is None and self.end > self._inputs[2]:
            self._again(dense=True)  # dense output must be compiled separately; a second run costs nearly nothing
        if self._series is None or not len(places):
            return np.broadcast_to(self.last, (len(places), len(self.last))).copy()
        return np.array(self._series(np.clip(places, *self._series.times[[0, -1]])), dtype=np.float64)
