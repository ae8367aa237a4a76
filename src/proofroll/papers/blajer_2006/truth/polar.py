"""Stick and slip in surface coordinates, with magnitude and direction of the slip: the route without heyoka.

With A = (1 + κ)/(κ m) and the friction F* that sticking would need, the slip velocity u obeys u̇ = A (F - F*) for any
friction F. In polar form u = |u| (cos φ e2 + sin φ e3), F = -μk N (cos φ, sin φ) and b = -A F*,

    d|u|/dt = b · (cos φ, sin φ) - A μk N,      |u| (φ̇ + ė2 · e3) = b · (-sin φ, cos φ).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from typing_extensions import override

from proofroll.core import heyoka_library as library
from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import TIGHTEST, controlled_step, solver_from
from proofroll.core.event_location import locate_rise
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion, world_motion
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.rolling_equations import reduced_rates, start
from proofroll.papers.blajer_2006.truth.sliding import End, Sliding
from proofroll.papers.blajer_2006.truth.taylor import SlidingTaylor

# Span of the central differences of the drive, in natural times.
_SPAN = 1e-4
_Stop = tuple[End, Callable[[FloatArray], float]]


def first_route(body: RollingBall) -> Sliding:
    """Route of the article's figures: Taylor series if heyoka is installed, else DOP853."""
    return SlidingTaylor(body) if library.available() else Polar(body)


class Polar(Sliding):
    """Route in surface coordinates u, their rates, and the spin ω1 about the normal.

    While slipping also slip speed and direction; see :class:`Sliding`.
    """

    name = "surface coordinates with direction of slip, DOP853"

    def __init__(self, body: RollingBall, handover: float = 1e-5) -> None:
        super().__init__(body, handover)
        ball = body.ball
        self._mu_k = body.contact.mu_kinetic if np.isfinite(body.contact.mu_kinetic) else 0.0  # unbounded: never slips
        self._A = (1 + ball.inertia_ratio) / (ball.inertia_ratio * ball.mass)
        pace = max(float(np.sqrt(ball.radius * np.linalg.norm(body.gravity)) + np.linalg.norm(body.v0)), 1e-300)
        self._pace = ball.radius / pace
        # Absolute tolerances: round-off in the rates of u, u̇, ω1 (and |u| or ln|u|, φ, t) must not drive the step.
        lengths = np.array(body.surface.length_scales)
        scales = [*(ball.radius / lengths), *(pace / lengths), max(pace / ball.radius, np.linalg.norm(body.w0))]
        self._atol = 1e-15 * np.array([*scales, 1.0, 1.0, self._pace])
        self._atol_slaved = 1e-15 * np.array([*scales, pace])

    @override
    def start(self) -> FloatArray:
        return start(self._body)

    @override
    def friction(self, state: FloatArray) -> tuple[float, float]:  # [N]
        b, N = self._drive(state)
        return float(np.linalg.norm(b)) / self._A, self._body.contact.mu_static * N

    def _missing(self, state: FloatArray) -> float:
        """Needed minus available friction [N]; smooth even if a step reaches beyond N = 0."""
        needed, available = self.friction(state)
        return needed - available

    @override
    def rates(self, state: FloatArray) -> FloatArray:
        return reduced_rates(self._body, state)[0]

    def _stick(self, time: float, state: FloatArray, until: float) -> ExplicitRun:
        def ended(solver: Any) -> tuple[float, FloatArray, End] | None:
            return _first(solver, [(End.CONE, self._missing)])

        return ExplicitRun(self.rates, time, state, until, atol=self._atol[:5], ended=ended)

    def _grown(self, time: float, state: FloatArray, until: float) -> float:
        strength, change = self._pull(state)
        pace = min(strength / change if change > 0 else np.inf, until - time)
        # A slip must grow by more than the round-off of the time resolves.
        return float(max(self._handover * strength * pace, 64 * strength * np.spacing(time), np.finfo(float).tiny))

    def _creep(self, time: float, state: FloatArray, until: float, handover: float) -> ExplicitRun:
        rates: Rates = lambda y: self._following(y)[0]  # noqa: E731 -- one line each for two closures

        def ended(solver: Any) -> tuple[float, FloatArray, End] | None:
            size = solver.y[5]
            if size >= handover:
                return _first(solver, [(End.GROWN, lambda y: y[5] - handover)])
            return _first(solver, [(End.STILL, lambda y: -y[5])]) if size <= 0 else None

        return ExplicitRun(rates, time, np.append(state, 0.0), until, atol=self._atol_slaved, ended=ended)

    def _slide(self, start_state: FloatArray, floor: float, until: float) -> ExplicitRun:
        stops: tuple[_Stop, ...] = ((End.TIME, lambda y: y[7] - until), (End.STILL, lambda y: floor - y[5]))

        def ended(solver: Any) -> tuple[float, FloatArray, End] | None:
            # The clock and ln|u| pass their limits only once, so values at the end of a step suffice.
            return _first(solver, [(end, g) for end, g in stops if g(solver.y) > 0])

        return ExplicitRun(self._slipping, 0.0, start_state, np.inf, atol=self._atol, ended=ended)

    def _drive(self, y: FloatArray) -> tuple[FloatArray, float]:
        """Drive b along e2, e3 [m/s²], shape (2,), and normal force N [N]."""
        return self._with_slip(y, 0.0, 0.0)[1:3]

    def _pull(self, y: FloatArray) -> tuple[float, float]:
        """Magnitudes of the drive b and of ḃ while sticking; ḃ by a central difference, as it only sets a scale."""
        rates = self.rates(y)
        span = _SPAN * self._pace
        b_rate = (self._drive(y + span * rates)[0] - self._drive(y - span * rates)[0]) / (2 * span)
        return float(np.linalg.norm(self._drive(y)[0])), float(np.linalg.norm(b_rate))

    def _with_slip(self, y: FloatArray, size: float, phi: float) -> tuple[FloatArray, FloatArray, float, float]:
        """Rates of (u, u̇, ω1), drive b, N and ė2 · e3 for a slip of ``size`` [m/s] in the direction ``phi`` [rad]."""
        body, surface = self._body, self._body.surface
        a, m, kappa, f = body.ball.radius, body.ball.mass, body.ball.inertia_ratio, body.contact.rolling_resistance
        frame, tangents, bending = surface.frame(y[:2]), surface.tangents(y[:2]), surface.second(y[:2]) @ y[2:4]
        across = frame.T[1:]
        (t22, t23), (t32, t33) = (across @ tangents).tolist()  # tangents along e2, e3
        inverse = np.array([[t33, -t23], [-t32, t22]]) / (t22 * t33 - t23 * t32)
        du2, du3 = y[2:4].tolist()
        v2, v3 = t22 * du2 + t23 * du3, t32 * du2 + t33 * du3
        turn2, turn3 = (-(frame[:, 0] @ bending) @ inverse).tolist()  # ė1 along e2, e3
        g1, g2, g3 = (frame.T @ body.gravity).tolist()
        N = m * (turn2 * v2 + turn3 * v3 + g1)
        spin = a * float(y[4])
        c, s = math.cos(phi), math.sin(phi)
        speed, grip = math.hypot(v2, v3), self._mu_k * N / m
        ahead = f * N / (kappa * m * a * speed) if f and speed > 0 else 0.0
        # e1 × (x, y) = (-y, x)
        b = np.array([g2 - spin * turn3 + ahead * v2, g3 + spin * turn2 + ahead * v3])
        u_second = inverse @ (np.array([g2 - grip * c, g3 - grip * s]) - across @ (bending @ y[2:4]))
        w2, w3 = (v3 - size * s) / a, (size * c - v2) / a  # e1 × (u - v) / a
        rates = np.array([du2, du3, *u_second.tolist(), w2 * turn2 + w3 * turn3])
        return rates, b, N, float(frame[:, 2] @ bending[:, 0]) / math.hypot(t22, t32)

    def _slipping(self, y: FloatArray) -> FloatArray:
        """d/dτ of (u, u̇, ω1, ln|u|, φ, t)."""
        size, phi = float(np.exp(y[5])), float(y[6])
        rates, b, N, turning = self._with_slip(y, size, phi)
        grip = self._A * self._mu_k * N
        c, s = math.cos(phi), math.sin(phi)
        b2, b3 = b.tolist()
        growth, around = b2 * c + b3 * s - grip, b3 * c - b2 * s - size * turning
        return np.array([*(size * rates).tolist(), growth, around, size])

    @override
    def _slaved(self, state: FloatArray) -> float:
        return self._following(state)[1]

    def _following(self, y: FloatArray) -> tuple[FloatArray, float]:
        """Rates of (u, u̇, ω1, |u|) and φ of the slaved slip, where φ - φ_b = -|u| φ̇_b / (|b| + d|u|/dt)."""
        b, N = self._drive(y)
        grip = self._A * self._body.contact.mu_kinetic * N
        phi, size, strength = float(np.arctan2(b[1], b[0])), float(y[5]), float(np.linalg.norm(b))
        leading, _, _, turning = self._with_slip(y, size, phi)
        span = _SPAN * self._pace
        change = (self._drive(y[:5] + span * leading)[0] - self._drive(y[:5] - span * leading)[0]) / (2 * span)
        rotation = float(b[0] * change[1] - b[1] * change[0]) / strength**2 + turning
        delta = -size * rotation / (2 * strength - grip)
        rates = self._with_slip(y, size, phi + delta)[0]
        return np.append(rates, strength * np.cos(delta) - grip), phi + delta

    def _stood_still(self, last: FloatArray) -> FloatArray:
        rates = self._slipping(last)
        return np.asarray(last + rates / -rates[5])

    def _motion(self, states: FloatArray) -> BallMotion:
        u, frame = states[:, :2], self._body.surface.frame(states[:, :2])
        v = np.einsum("nij,nj->ni", self._body.surface.tangents(u), states[:, 2:4])
        drives = [self._drive(row) for row in states]
        b, N = np.array([d[0] for d in drives]).reshape(-1, 2), np.array([d[1] for d in drives])
        local = np.einsum("nij,ni->nj", frame[..., 1:], v)
        return world_motion(
            self._body, u, velocity=local, spin=states[:, 4], friction=-b / self._A, press=N, route=self.name
        )


def _first(solver: Any, stops: Sequence[_Stop]) -> tuple[float, FloatArray, End] | None:
    """First of some stops within the last step: time or τ, state and reason; None: there is none."""
    rise = locate_rise(solver, lambda y: np.array([g(y) for _, g in stops])) if stops else None
    return (rise.time, rise.state, stops[rise.guard][0]) if rise else None


Rates = Callable[[FloatArray], FloatArray]


class ExplicitRun:
    """Integration from ``start`` to its end; implements :class:`.IntegratedRun`.

    After each step ``ended`` gets the solver and returns time [s], state and reason of an end within that step; None:
    the run goes on.
    """

    def __init__(
        self,
        rates: Rates,
        start: float,
        state: FloatArray,
        until: float,
        *,
        atol: FloatArray,
        ended: Callable[[Any], tuple[float, FloatArray, End] | None],
    ) -> None:
        self.end, self.last, self.why = until, state, End.TIME
        self._between: list[Callable[[float], FloatArray]] = []
        starts = [start]
        # rates may not be finite for a run of zero length
        solver = solver_from(lambda _, y: rates(y), start, state, TIGHTEST, atol) if until > start else None
        while solver is not None and solver.t < until:
            controlled_step(solver, None, until, math.inf)
            self._between.append(solver.dense_output())
            starts.append(solver.t)
            self.last = solver.y
            if stopped := ended(solver):
                self.end, self.last, self.why = stopped
                break
        self._starts = np.array(starts[:-1])

    def at(self, places: FloatArray) -> FloatArray:
        """See :class:`proofroll.papers.blajer_2006.truth.sliding.IntegratedRun`."""
        if not self._between or not len(places):
            return np.broadcast_to(self.last, (len(places), len(self.last))).copy()
        index = np.searchsorted(self._starts, places, side="right") - 1
        return np.array([self._between[i](x) for i, x in zip(index, places, strict=True)])
