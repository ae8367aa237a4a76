"""Stick and slip by compiled Taylor series: the fast route, for cylinders and planes, where heyoka is installed."""

from __future__ import annotations

from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.elements.ball_on_surface.compiled import library
from proofroll.elements.ball_on_surface.compiled.rolling import is_uniform, parameters, start
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion, world_motion
from proofroll.elements.ball_on_surface.surfaces import Cylinder, Plane
from proofroll.truth.assemble import classic_step, joined
from proofroll.truth.impact import by_coefficients
from proofroll.truth.polar import BEGUN, direction
from proofroll.truth.route import End, Leg
from proofroll.truth.taylor_model import TaylorModel, model

# Stop conditions of the integrators in the order of their events.
_STICK_ENDS = (End.LIFTOFF, End.CONE)
_SLIP_ENDS = (End.STILL, End.TIME, End.LIFTOFF)
_LARGEST = 1e100  # friction that can still be squared
_TIME_LIMIT = -(2**32) - 3  # heyoka's taylor_outcome.time_limit
_FLOOR = 1e-4  # |u| at which the rest of a slip is extrapolated, relative to where it began


def available() -> bool:
    """Whether heyoka is installed."""
    return library.available()


def supports(body: RollingBall) -> bool:
    """Whether the compiled equations hold for this scene.

    The direction of the rolling resistance jumps where the centre stands still. A Taylor series does not see the
    jump, so with resistance only the vertical cylinder is taken, where the centre of a pressed ball always moves.
    """
    surface = body.surface
    if isinstance(surface, Plane):
        return body.contact.rolling_resistance == 0
    if not isinstance(surface, Cylinder):
        return False
    return body.contact.rolling_resistance == 0 or _vertical(body, surface)


def _vertical(body: RollingBall, surface: Cylinder) -> bool:
    return not np.any(np.cross(body.gravity, surface.generators[1].axis))


class SlidingTaylor:
    """Route in the local frame with (ln|u|, direction) against τ, dt = |u| dτ, while slipping.

    Against τ the end of a slip, |u| → 0, is a smooth decay to infinity. The start of a slip is not: there the direction
    follows the drive ever more stiffly. Until |u| reaches ``handover`` |b| T, with T = |b|/|ḃ| the time in which the
    drive b changes, the direction is slaved to the drive.

    State: arc length q, height h [m], v2, v3 [m/s], ω1 [rad/s].
    """

    name = "local frame with direction of slip, Taylor series"

    def __init__(self, body: RollingBall, handover: float = 1e-5) -> None:
        surface, contact = body.surface, body.contact
        self._body = body
        self._handover = handover
        self._scales = np.array(surface.length_scales)
        self._A = (1 + body.ball.inertia_ratio) / body.ball.inertia_ratio
        self._pars = [*parameters(body), *(min(mu, _LARGEST) for mu in (contact.mu_kinetic, contact.mu_static))]
        bounded = bool(np.isfinite(contact.mu_static))
        self._model: TaylorModel = model(contact.rolling_resistance > 0, is_uniform(body), bounded)

    def start(self) -> FloatArray:
        """See :class:`Route`."""
        return start(self._body)

    def at(self, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray) -> FloatArray:
        """See :class:`Route`."""
        u = self._body.surface.locate(p_WB)
        frame = self._body.surface.frame(u)
        return np.concatenate([u * self._scales, frame[:, 1:].T @ v_WB, [w_WB @ frame[:, 0]]])

    def impact(
        self, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray, e: float, e_t: float
    ) -> tuple[FloatArray, FloatArray]:
        """See :class:`Route`."""
        return by_coefficients(self._body, p_WB, v_WB, w_WB, e, e_t)

    def excess(self, state: FloatArray) -> float:
        """See :class:`Route`."""
        b2, b3, _, N = self._model.drive(state, self._pars)
        needed, available = float(np.hypot(b2, b3)), self._A * self._body.contact.mu_static * float(N)
        return (needed - available) / max(needed + available, np.finfo(float).tiny)

    def ahead(self, state: FloatArray, span: float) -> FloatArray:
        """See :class:`Route`."""
        return classic_step(self._rates, state, span)

    def _rates(self, state: FloatArray) -> FloatArray:
        return self._model.rates(state, self._pars)

    def world(self, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """See :class:`Route`."""
        motion = self._motion(state[None, :], np.zeros(1), None)
        return motion.p_WB[0], motion.v_WB[0], motion.w_WB[0]

    def nudged(self, state: FloatArray, v_WB: FloatArray) -> FloatArray:
        """See :class:`Route`."""
        frame = self._body.surface.frame(state[:2] / self._scales)
        return np.concatenate([state[:2], frame[:, 1:].T @ v_WB, state[4:]])

    def stick(self, time: float, state: FloatArray, until: float) -> Leg[FloatArray]:
        """See :class:`Route`."""
        run = _Run(self._model.stick, self._pars, time, state, until)

        def motion(times: FloatArray) -> BallMotion:
            return self._motion(run.at(times), np.zeros(len(times)), None)

        return Leg(time, run.end, True, run.last, End.TIME if run.event is None else _STICK_ENDS[run.event], motion)

    def slip(self, time: float, state: FloatArray, until: float, slip: FloatArray | None = None) -> Leg[FloatArray]:
        """See :class:`Route`."""
        b2, b3, change, _ = self._model.drive(state, self._pars)
        strength = float(np.hypot(b2, b3))
        pace = min(strength / change if change > 0 else np.inf, until - time)
        handover = max(self._handover * strength * pace, np.finfo(float).tiny)
        if slip is not None:
            handover = max(handover, BEGUN * float(np.linalg.norm(slip)))
        # One that does not begin from rest has no such start.
        begin = until if slip is None else time
        creep = _Run(self._model.creep, [*self._pars, handover], time, np.append(state, 0.0), begin)

        def creeping(times: FloatArray) -> BallMotion:
            states = creep.at(times)
            return self._motion(states[:, :5], states[:, 5], self._model.direction(states.T, self._pars)[0])

        small = creep.last
        if slip is not None:
            small = np.append(state, np.linalg.norm(slip))
        elif creep.event != 0:  # the time is over, or the ball stands still before the handover
            why = End.TIME if creep.event is None else End.STILL
            return Leg(time, creep.end, False, small[:5], why, creeping)
        phi = self._model.direction(small, self._pars)[0]
        if slip is not None:
            phi = direction(self._body.surface.frame(state[:2] / self._scales), slip)
        first = np.array([*small[:5], np.log(small[5]), phi, creep.end])
        run = _Run(self._model.slip, [*self._pars, np.log(_FLOOR * handover), until], 0.0, first, np.inf)

        def slipping(times: FloatArray) -> BallMotion:
            states = _at_times(run, times)
            return self._motion(states[:, :5], np.exp(states[:, 5]), states[:, 6])

        def motion(times: FloatArray) -> BallMotion:
            return joined(times, creep.end, creeping, slipping)

        why = _SLIP_ENDS[run.event or 0]
        end, last = (float(run.last[7]), run.last[:5]) if why is not End.STILL else self._stood_still(run.last)
        if end >= until:
            why, end = End.TIME, until
        return Leg(time, end, False, last, why, motion)

    def _stood_still(self, last: FloatArray) -> tuple[float, FloatArray]:
        """Time and state at |u| = 0, linearly from a |u| so small that nothing else is seen."""
        b2, b3, _, N = self._model.drive(last[:5], self._pars)
        cos, sin = np.cos(last[6]), np.sin(last[6])
        mu = self._body.contact.mu_kinetic
        slowing = self._A * mu * N - b2 * cos - b3 * sin
        left = float(np.exp(last[5]) / slowing)
        # The rates of sticking with one friction exchanged for the other
        rates = self._rates(last[:5])
        rates[2] += -mu * N * cos + b2 / self._A
        rates[3] += -mu * N * sin + b3 / self._A
        return float(last[7]) + left, last[:5] + left * rates

    def _motion(self, states: FloatArray, size: FloatArray, phi: FloatArray | None) -> BallMotion:
        """Motion in states, shape (n, 5), slipping with speed ``size`` [m/s] in direction ``phi`` (None: sticking)."""
        ball = self._body.ball
        b2, b3, _, N = self._model.drive(states.T, self._pars)
        if phi is None:
            friction, u = -np.stack([b2, b3], axis=-1) / self._A, np.zeros((len(states), 2))
        else:
            along = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
            friction, u = -self._body.contact.mu_kinetic * N[:, None] * along, size[:, None] * along
        return world_motion(
            self._body,
            states[:, :2] / self._scales,
            velocity=states[:, 2:4],
            spin=states[:, 4],
            slip=u,
            friction=ball.mass * friction,
            press=ball.mass * N,
            route=self.name,
        )


class _Run:
    """One run of a compiled integrator to ``until`` or the first event, and again where states between are asked for.

    Attributes:
        event: index of the event that ended it, or None.
        end: value of the independent variable at the end.
        last: state at the end.
    """

    def __init__(self, integrator: Any, pars: list[float], time: float, state: FloatArray, until: float) -> None:
        self._given = (integrator, pars, time, state, min(until, 1e300))
        self._series: Any = None
        self.event: int | None = None
        self.end, self.last = time, state
        if until > time:
            code = self._again(dense=False)
            self.event = -code - 1 if -(2**31) < code < 0 else None  # terminal events are numbered -1, -2, …
            if (self.event is None and code != _TIME_LIMIT) or not np.all(np.isfinite(integrator.state)):
                raise Diverged(f"the truth (Taylor series) could not be integrated past {integrator.time:g}")
            self.end, self.last = float(integrator.time), integrator.state.copy()

    def _again(self, dense: bool) -> int:
        integrator, pars, time, state, until = self._given
        integrator.time = time
        integrator.pars[:] = pars[: len(integrator.pars)]
        integrator.state[:] = state
        integrator.reset_cooldowns()
        result = integrator.propagate_until(until, c_output=dense)
        self._series = result[4]
        return int(result[0])

    @property
    def knots(self) -> FloatArray:
        """Ends of the steps."""
        if self._series is None and self.end > self._given[2]:
            self._again(dense=True)  # a dense series costs a compilation of its own, a second run nearly nothing
        return np.asarray([self.end] if self._series is None else self._series.times)

    def at(self, where: FloatArray) -> FloatArray:
        """States, shape (n, k)."""
        if len(self.knots) < 2 or not len(where):
            return np.broadcast_to(self.last, (len(where), len(self.last))).copy()
        return np.array(self._series(np.clip(where, self.knots[0], self.knots[-1])), dtype=np.float64)


def _at_times(slip: _Run, times: FloatArray) -> FloatArray:
    """States of the slip integrator, shape (n, 8), where its clock shows the times: Newton's method for τ."""
    knots = slip.knots
    tau = np.interp(times, slip.at(knots)[:, 7], knots)
    for _ in range(50):
        states = slip.at(tau)
        late = times - states[:, 7]
        if np.all(np.abs(late) <= 4 * np.finfo(float).eps * np.abs(times)):
            break
        tau = np.clip(tau + late / np.exp(states[:, 5]), knots[0], knots[-1])
    return slip.at(tau)
