"""Stick and slip by implicit collocation in the world frame: the second route."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.errors import Diverged
from proofroll.core.event_location import first_rise
from proofroll.elements.ball_on_surface.mechanics import always_pressed
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface import unreduced_taylor
from proofroll.truth.ball_on_surface.contact import ContactRates
from proofroll.truth.ball_on_surface.route import BallStretch, End, Route, World, about_to_stop, join_motions
from proofroll.truth.numerics.collocation import Step, System, next_length, nodes, take

_TOLERANCE = 1e-13  # of a step, relative to the scale of each variable
_APPROACH = 0.5  # fraction of the time left until standstill that one step may take, far from it,
_CLOSE = 0.99  # and near it, where that time is known accurately
_FURTHER = 1.2  # how far a polynomial is extrapolated, relative to its own step
_MANY = 300  # steps of a rolling stretch; the rest of a longer one is left to a compiled Taylor series


class Implicit(Route):
    """Route in the state y = (p, ω, u) of :class:`ContactRates`.

    Args:
        body: the scene's ball.
        first_step: longest first step of a slip, relative to the pace of the motion; that step starts at u = 0.
    """

    name = "world frame by signed distance, implicit collocation"

    def __init__(self, body: RollingBall, first_step: float = 0.1) -> None:
        self._body = body
        self._contact = ContactRates(body)
        self._first = first_step
        self._pace = body.ball.radius / max(float(self._contact.scale[-1]), 1e-300)  # [s]
        self._mu = body.contact.mu_static
        self._held = always_pressed(body)  # then no step is searched for a lift-off

    @override
    def start(self) -> FloatArray:
        return np.concatenate([self._body.p0, self._body.w0, np.zeros(3)])

    def friction(self, state: FloatArray) -> tuple[float, float]:
        """See :class:`Route`; [N]."""
        needed, available = (float(x[0]) for x in self._needed_and_available(state[None, :]))
        return needed, available

    @override
    def rates(self, state: FloatArray) -> FloatArray:
        return np.asarray(self._contact.rates(state[None, :], True)[0])

    @override
    def world(self, state: FloatArray) -> World:
        return state[:3], self._contact.velocity(state[None, :])[0], state[3:6]

    @override
    def nudged(self, state: FloatArray, v_WB: FloatArray) -> FloatArray:
        e1 = self._body.surface.normal(state[:3])
        w = (state[3:6] @ e1) * e1 - cross(e1, v_WB) / self._body.ball.radius
        return np.concatenate([state[:3], w, np.zeros(3)])

    @override
    def stick(self, time: float, state: FloatArray, until: float) -> BallStretch:
        walk = _Walk(self._contact.system(sticking=True), time, state, until)
        resisted = self._body.contact.rolling_resistance > 0
        length = self._pace
        compiled = self._held and unreduced_taylor.available(self._body)
        while walk.time < until:
            if compiled and len(walk.steps) == _MANY:
                return self._rolls_on(walk, until)
            left = self._until_still(walk.state, True) if resisted else np.inf
            if about_to_stop(left, self._pace, walk.time):
                halted = walk.state + left * self.rates(walk.state)
                return walk.stretch(self, True, walk.time + left, self.nudged(halted, np.zeros(3)), End.HALT)
            step, length = walk.step(min(length, self._approach(left)))
            ends = [] if self._held else [(End.LIFTOFF, partial(self._pull_along, step, True))]
            ends += [(End.CONE, partial(self._excess_along, step))] if np.isfinite(self._mu) else []
            rises = [(first_rise(g, step.time, step.time + step.length), why) for why, g in ends]
            if ended := [(when, why) for when, why in rises if when is not None]:
                when, why = min(ended, key=lambda item: item[0])
                return walk.stretch(self, True, when, walk.cut(when), why)
        return walk.stretch(self, True, until, walk.state, End.TIME)

    def _rolls_on(self, walk: _Walk, until: float) -> BallStretch:
        """Continues a long roll by Taylor series of the same equations, which take a fraction of the time."""
        y, begun = walk.state, walk.time
        end, slips, states = unreduced_taylor.until_slip(self._body, begun, y[:6], until)

        def at(times: FloatArray) -> FloatArray:
            return np.concatenate([states(times), np.zeros((len(times), 3))], axis=1)

        early = walk.stretch(self, True, begun, y, End.TIME).motion

        def motion(times: FloatArray) -> BallMotion:
            return join_motions(times, [(-np.inf, early), (begun, lambda late: self.motion(at(late), True))], self.name)

        return BallStretch(
            start=walk.start,
            end=end,
            sticking=True,
            state=at(np.array([end]))[0],
            why=End.CONE if slips else End.TIME,
            motion=motion,
        )

    @override
    def slip(self, time: float, state: FloatArray, until: float) -> BallStretch:
        walk = _Walk(self._contact.system(sticking=False), time, state, until)
        length = min(self._first * self._pace, until - time)
        while walk.time < until:
            started = bool(walk.steps)
            left = self._until_still(walk.state, False) if started else np.inf
            if about_to_stop(left, self._pace, walk.time):
                still = walk.state + left * self._contact.rates(walk.state[None, :], False)[0]
                still[6:] = 0.0
                if walk.time + left > until:
                    break
                return walk.stretch(self, False, walk.time + left, still, End.STILL)
            guess = None if started else self._first_guess(state)
            step, length = walk.step(min(length, self._approach(left)), guess)
            pull = partial(self._pull_along, step, False)
            gone = None if self._held else first_rise(pull, step.time, step.time + step.length)
            if gone is not None:
                return walk.stretch(self, False, gone, walk.cut(gone), End.LIFTOFF)
        return walk.stretch(self, False, until, walk.state, End.TIME)

    def motion(self, y: FloatArray, sticking: bool) -> BallMotion:
        """Motion of the ball in the given states, shape (n, 9)."""
        return BallMotion(
            p_WB=y[:, :3],
            v_WB=self._contact.velocity(y),
            w_WB=y[:, 3:6],
            force=self._contact.force(y, sticking),
            route=self.name,
        )

    def force_at_start(self, state: FloatArray) -> FloatArray:
        """Force of the wall at the start of a slip [N], shape (3,), where u = 0 but its direction is known."""
        tiny = np.concatenate([state[:6], 1e-100 * self._contact.slip_direction_at_rest(state)])
        return np.asarray(self._contact.force(tiny[None, :], False)[0])

    def _needed_and_available(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        friction, N = self._contact.split(y, sticking=True)
        return np.linalg.norm(friction, axis=-1), self._mu * N

    def _excess_along(self, step: Step, times: FloatArray) -> FloatArray:
        """Needed minus available friction [N]; smooth even if a step reaches beyond N = 0."""
        needed, available = self._needed_and_available(step(times))
        return needed - available

    def _pull_along(self, step: Step, sticking: bool, times: FloatArray) -> FloatArray:
        """-N [N]; rises through zero where the ball leaves the wall."""
        return -self._contact.split(step(times), sticking)[1]

    def _until_still(self, state: FloatArray, sticking: bool) -> float:
        """Time until the centre (sticking) or the contact point (slipping) stops at this rate [s]; inf: never."""
        rates = self._contact.rates(state[None, :], sticking)[0]
        if sticking:
            v, e1 = self._contact.velocity(state[None, :])[0], self._body.surface.normal(state[:3])
            v_rate = -self._body.ball.radius * cross(rates[3:6], e1)
        else:
            v, v_rate = state[6:], rates[6:]
        size = float(np.linalg.norm(v))
        slowing = -float(v @ v_rate) / size if size > 0 else 0.0
        return size / slowing if slowing > 0 else np.inf

    def _approach(self, left: float) -> float:
        """Longest step [s] when ``left`` [s] remain until standstill."""
        return left * float(np.clip(1 - 2 * left / self._pace, _APPROACH, _CLOSE))

    def _first_guess(self, state: FloatArray) -> Callable[[float], FloatArray]:
        """Guess of the states at the nodes of the first step of a slip, as a function of its length [s].

        The slip velocity is u = (G t + α t²/2) d; the other variables follow their tangent.
        """
        d = self._contact.slip_direction_at_rest(state)

        def growth(y: FloatArray) -> tuple[float, FloatArray]:
            heading = self._contact.slip_direction_at_rest(y)
            rates = self._contact.rates(np.concatenate([y[:6], 1e-100 * heading])[None, :], False)[0]
            return float(rates[6:] @ heading), rates

        G, rates = growth(state)
        span = 1e-4 * self._pace
        alpha = (growth(state + span * rates)[0] - G) / span

        def guess(length: float) -> FloatArray:
            t = nodes(length)[:, None]
            y = state + t * rates
            y[:, 6:] = np.maximum(G * t + 0.5 * alpha * t**2, 1e-100) * d
            return y

        return guess


class _Walk:
    """Steps of one stretch with error control."""

    def __init__(self, system: System, time: float, state: FloatArray, until: float) -> None:
        self._system, self.start, self._state, self._until = system, time, state, until
        self.steps: list[Step] = []

    @property
    def time(self) -> float:
        """Time reached so far [s]; exactly ``until`` at the end."""
        if not self.steps:
            return self.start
        end = self.steps[-1].time + self.steps[-1].length
        return self._until if self._until - end <= 4 * np.spacing(self._until) else end

    @property
    def state(self) -> FloatArray:
        """State reached so far, shape (9,)."""
        return self.steps[-1].last if self.steps else self._state

    def step(self, length: float, guess: Callable[[float], FloatArray] | None = None) -> tuple[Step, float]:
        """Takes one accepted step, at most ``length`` long [s]; returns it and the length to try next."""
        length = min(length, self._until - self.time)
        # The round-off of a large spin or slip is relative to its present size, so its tolerance is too.
        sizes = [0.0, *np.linalg.norm(self.state[3:].reshape(2, 3), axis=-1)]
        system = replace(self._system, scale=np.maximum(self._system.scale, np.repeat(sizes, 3)))
        guess = guess or self._continued
        while True:
            if self.time + length == self.time:
                raise Diverged(f"the truth (implicit collocation) could not be integrated past {self.time:g} s")
            step = take(system, self.time, self.state, length, guess(length))
            next_step = next_length(step, _TOLERANCE)
            if step.error <= _TOLERANCE:
                self.steps.append(step)
                return step, next_step
            length, guess = min(next_step, 0.8 * length), self._tangent if self.steps else guess

    def _continued(self, length: float) -> FloatArray:
        """Guess from the last step's polynomial, or from the tangent at its end if that would extrapolate too far."""
        if not self.steps or length > _FURTHER * self.steps[-1].length:
            return self._tangent(length)
        return self.steps[-1](self.time + nodes(length))

    def _tangent(self, length: float) -> FloatArray:
        """Guess along the tangent at the end of the last step: less accurate than the polynomial, but safer."""
        rates = self._system.rates(self.state[None, :])[0]
        return np.asarray(self.state + nodes(length)[:, None] * rates)

    def cut(self, time: float) -> FloatArray:
        """State at a time [s] within the last step, shape (9,)."""
        return np.asarray(self.steps[-1](np.array([time]))[0])

    def stretch(self, route: Implicit, sticking: bool, end: float, state: FloatArray, why: End) -> BallStretch:
        """Stretch made of the steps so far."""
        steps, start_state = self.steps, self._state
        starts = np.array([step.time for step in steps])

        def motion(times: FloatArray) -> BallMotion:
            y = np.broadcast_to(start_state, (len(times), 9)).copy()
            index = np.searchsorted(starts, times, side="right") - 1
            for number in np.unique(index[index >= 0]):
                inside = index == number
                y[inside] = steps[number](np.minimum(times[inside], starts[number] + steps[number].length))
            result = route.motion(y, sticking)
            if not sticking:
                for row in np.flatnonzero(~np.any(y[:, 6:], axis=-1)):
                    result.force[row] = route.force_at_start(y[row])
            return result

        return BallStretch(start=self.start, end=end, sticking=sticking, state=state, why=why, motion=motion)
