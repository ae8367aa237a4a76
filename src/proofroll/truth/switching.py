"""The sequence of sticking and slipping, whatever integrates each leg of it.

A leg is a stretch of time in one mode. A :class:`Route` integrates one leg at a time and says why it ended; here is
decided what comes next. Nothing limits the number of legs: only the end of time ends the sequence.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Generic, Protocol, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.ball_on_surface.events import EventKind
from proofroll.elements.ball_on_surface.mechanics import natural_acceleration
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.elements.ball_on_surface.resting import setting_off, stands, stays
from proofroll.truth.crossing import first_rise

# Relative distance from the friction cone below which round-off decides on which side a state is.
_ON_CONE = 1e-13
# Normal force at time 0, relative to the natural one, below which the ball is off the wall and not at its round-off.
_OFF_WALL = 1e-12
# A ball that leaves the wall is looked for on it from this part of its pace on; its gap has grown from zero till then.
_LEFT = 1e-3
# Part of the natural speed at which a ball that goes back and forth ever less is taken to be at rest: it has some 1e-9
# of the natural time to go, and 1e-18 of the way. Reversals much smaller than that drown in the round-off of the time.
_AT_REST = 1e-9
# Parts of the speed of a fall by the radius: bounces slower than the first are over, and only those faster than the
# second, a hundredth of the radius high, are told as events; slower than the third a contact point stands still.
_LOW, _SEEN, _STANDS = 1e-6, 0.14, 1e-12
# As many slips in a row, each shorter than the one before, are followed on the way there; each costs both routes the
# search for the place where the direction of the resistance jumps.
_REVERSALS = 10

State = TypeVar("State")


class End(Enum):
    """Why a leg ended."""

    TIME = auto()  # the last time was reached
    CONE = auto()  # sticking: the needed friction left the static cone
    STILL = auto()  # slipping: the contact point stands still
    HALT = auto()  # sticking with rolling resistance: the centre stands still
    LIFTOFF = auto()  # the normal force reached zero


@dataclass(frozen=True)
class Leg(Generic[State]):
    """One stretch of time in one mode.

    Attributes:
        start, end: [s].
        sticking: the mode.
        state: at the end; the slip velocity in it is zero unless the ball slips there.
        why: why it ended.
        motion: times within the leg [s], shape (n,) -> motion at these times.
    """

    start: float
    end: float
    sticking: bool
    state: State
    why: End
    motion: Callable[[FloatArray], BallMotion]


class Route(Protocol[State]):
    """One way of integrating the legs, in state variables of its own."""

    @property
    def name(self) -> str:
        """How the legs are integrated, for a person."""

    def start(self) -> State:
        """State at time 0; that the ball slips there is not part of it."""

    def at(self, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray) -> State:
        """State of a ball that touches the wall, with these place [m], velocity [m/s] and spin [rad/s]."""

    def impact(
        self, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray, e: float, e_t: float
    ) -> tuple[FloatArray, FloatArray]:
        """Velocity [m/s] and spin [rad/s] after an impact with these coefficients of restitution."""

    def excess(self, state: State) -> float:
        """(needed - available) / (needed + available) with the friction needed to stick and μs N [-]."""

    def ahead(self, state: State, span: float) -> State:
        """The state after sticking for a short ``span`` [s], to third order at least."""

    def stick(self, time: float, state: State, until: float) -> Leg[State]:
        """Roll without slip from ``time`` to ``until`` at the latest [s]."""

    def slip(self, time: float, state: State, until: float, slip: FloatArray | None = None) -> Leg[State]:
        """Slip from ``time`` to ``until`` at the latest [s].

        The contact point starts with the velocity ``slip`` in the world [m/s], shape (3,), or at rest (None).
        """

    def world(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
        """p_WB [m], v_WB [m/s], w_WB [rad/s] of the state, each shape (3,)."""

    def nudged(self, state: State, v_WB: FloatArray) -> State:
        """The state rolling with the centre's velocity ``v_WB`` [m/s], shape (3,), in place of its own."""


@dataclass(frozen=True)
class Path(Generic[State]):
    """The whole sequence.

    Attributes:
        legs: one after another from time 0.
        events: kind and time [s] of each change.
        lands: when a ball that has left the wall is back on it [s], where the path ends; None: not until the end.
    """

    legs: list[Leg[State]]
    events: list[tuple[EventKind, float]]
    lands: float | None = None

    def motion(self, times: FloatArray, route: str) -> tuple[BallMotion, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
        """Motion at ``times`` [s] and whether the ball sticks there; a time of an event belongs to the later leg."""
        index = np.searchsorted([leg.start for leg in self.legs], times, side="right") - 1
        columns = {key: np.empty((len(times), 3)) for key in ("p_WB", "v_WB", "w_WB", "force")}
        for number in np.unique(index):
            here = index == number
            part = self.legs[number].motion(times[here])
            for key, column in columns.items():
                column[here] = getattr(part, key)
        sticking = np.array([leg.sticking for leg in self.legs])[index]
        return BallMotion(**columns, route=route), sticking


def follow(body: RollingBall, route: Route[State], until: float) -> Path[State]:  # noqa: PLR0912, PLR0915 -- one per end
    """Everything from time 0 to ``until`` [s].

    Raises:
        Refused: the ball slips to and fro ever faster.
        Diverged: a route makes no progress.
    """
    legs: list[Leg[State]] = []
    reversals = 0
    events: list[tuple[EventKind, float]] = []
    time, state = 0.0, route.start()
    if not body.gap0 and stands(body, route.world(state)[1]):
        if stays(body, route.world(state)[0]):
            return Path([_rest(body, route, state, time, until)], events)
        state = route.nudged(state, setting_off(body, route.world(state)[0]))
    slip = body.slip0 if np.any(body.slip0) else None
    falls = _pressed(body, *route.world(state)[:2]) < -_OFF_WALL * natural_acceleration(body)
    if falls:
        events.append(("lift_off", time))
    if falls or body.gap0 > 0:
        came = _airborne(body, route, (body.p0, body.v0, body.w0), time, until, legs, events)
        if not isinstance(came, Landed):
            return Path(legs, events, came)
        time, slip, state = came.time, came.slip, _touching(route, came)
    sticking = slip is None and not _must_slip(body, route, state)
    if not sticking:
        events.append(("slip", time))
    while True:
        leg = route.stick(time, state, until) if sticking else route.slip(time, state, until, slip)
        slip = None
        legs.append(leg)
        if not leg.end > time and leg.why is not End.TIME and len(legs) > 1 and legs[-2].end == legs[-2].start:
            raise Diverged(f"the truth makes no progress at {time:g} s, where sticking and slipping alternate at once")
        time, state = leg.end, leg.state
        if leg.why is End.TIME:
            return Path(legs, events)
        if leg.why is End.LIFTOFF:
            events.append(("lift_off", time))
            last = leg.motion(np.array([time]))  # with the slip that a state does not tell
            came = _airborne(body, route, (last.p_WB[0], last.v_WB[0], last.w_WB[0]), time, until, legs, events)
            if not isinstance(came, Landed):
                return Path(legs, events, came)
            time, slip, state = came.time, came.slip, _touching(route, came)
            sticking = slip is None and not _must_slip(body, route, state)
            if not sticking:
                events.append(("slip", time))
            continue
        if _comes_to_rest(body, route, leg):
            if not sticking:
                events.append(("stick", time))
            legs.append(_rest(body, route, route.nudged(state, np.zeros(3)), time, until))
            return Path(legs, events)
        if leg.why is End.HALT:
            state = route.nudged(state, setting_off(body, route.world(state)[0]))
        hastens = len(legs) > 1 and leg.end - leg.start < legs[-2].end - legs[-2].start
        reversals = reversals + 1 if leg.why is End.STILL and not sticking and hastens else 0
        if reversals > _REVERSALS:
            raise Refused(
                f"from about {time:.6g} s on the ball slips to and fro ever faster, for resistance stops the rolling "
                "before friction stops the centre; end the run earlier, or take more friction or less resistance"
            )
        # With |u| = 0 the ball sticks if it can; where the needed force is outside the cone it goes on slipping.
        must_slip = leg.why is End.CONE or _must_slip(body, route, state)
        if must_slip and sticking:
            events.append(("slip", time))
        elif not must_slip and not sticking:
            events.append(("stick", time))
        sticking = not must_slip


def _must_slip(body: RollingBall, route: Route[State], state: State) -> bool:
    """Whether the needed friction is outside the static cone, or on it and about to leave."""
    if not np.isfinite(body.contact.mu_static):
        return False
    excess = route.excess(state)
    if abs(excess) > _ON_CONE:
        return excess > 0
    a, speed = body.ball.radius, float(np.linalg.norm(route.world(state)[1]))
    pace = np.sqrt(a * np.linalg.norm(body.gravity)) + speed
    return bool(pace > 0 and route.excess(route.ahead(state, 1e-3 * a / pace)) > _ON_CONE)


def _comes_to_rest(body: RollingBall, route: Route[State], leg: Leg[State]) -> bool:
    """Whether the ball stops at the end of a leg and can rest there: its centre, or all but round-off of a slip.

    Where resistance slows the rolling faster than friction the centre, the ball slips to a stop, rolls back a part of
    the way and so on: on a level plane infinitely often in a finite time, each time by the same part.
    """
    p, v, _ = route.world(leg.state)
    speed = np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)) + np.linalg.norm(body.v0)
    settled = leg.why is End.STILL and np.linalg.norm(v) <= _AT_REST * speed
    return body.contact.rolling_resistance > 0 and bool(leg.why is End.HALT or settled) and stays(body, p)


def _rest(body: RollingBall, route: Route[State], state: State, time: float, until: float) -> Leg[State]:
    p, _, w = route.world(state)
    e1 = body.surface.normal(p)
    force = -body.ball.mass * body.gravity

    def motion(times: FloatArray) -> BallMotion:
        p_WB, v_WB, w_WB, held = (np.broadcast_to(x, (len(times), 3)) for x in (p, np.zeros(3), (w @ e1) * e1, force))
        return BallMotion(p_WB, v_WB, w_WB, held, "at rest")

    return Leg(time, until, True, state, End.TIME, motion)


def _pressed(body: RollingBall, p_WB: FloatArray, v_WB: FloatArray) -> float:
    """Normal force over mass that keeps the centre on its surface [m/s²]."""
    e1, bend = body.surface.normal(p_WB), body.surface.normal_gradient(p_WB)
    return float(e1 @ body.gravity + v_WB @ bend @ v_WB)


@dataclass(frozen=True)
class Landed:
    """A ball that has come to stay on the wall.

    Attributes:
        time: since when [s].
        world: its place [m], velocity [m/s] and spin [rad/s] then.
        slip: velocity of its contact point [m/s], shape (3,); None: it rolls.
    """

    time: float
    world: tuple[FloatArray, FloatArray, FloatArray]
    slip: FloatArray | None


def _touching(route: Route[State], landed: Landed) -> State:
    """The state in which a ball goes on that has landed."""
    state = route.at(*landed.world)
    return state if landed.slip is not None else route.nudged(state, landed.world[1])


def _airborne(
    body: RollingBall,
    route: Route[State],
    world: tuple[FloatArray, FloatArray, FloatArray],
    time: float,
    until: float,
    legs: list[Leg[State]],
    events: list[tuple[EventKind, float]],
) -> Landed | float | None:
    """Flights and impacts from ``time`` on, added to the legs and events, until the ball stays on the wall.

    A ball that leaves each impact with e times its speed bounces infinitely often in a finite time: below a speed that
    does not matter (:data:`_LOW`) its last impact takes all of it, which gives the wall the same impulse as all the
    others together.

    Returns:
        How it goes on; None if it flies until the end; the time [s] of a landing about which nothing is said.
    """
    e, e_t = body.contact.restitution, body.contact.tangential_restitution
    natural = np.sqrt(body.ball.radius * np.linalg.norm(body.gravity))
    while True:
        lands, motion = _flight(body, world, time, until)
        legs.append(Leg(time, until if lands is None else lands, False, route.start(), End.TIME, motion))
        if lands is None or e is None:
            return lands
        if body.wall_rate is not None:
            raise Refused(f"the ball lands at t = {lands:.9g} s on a wall that moves, which is not followed")
        if not lands > time:
            raise Diverged(f"the truth makes no progress at {time:g} s, where the ball bounces")
        time = lands
        at = motion(np.array([time]))
        p, v, w = at.p_WB[0], at.v_WB[0], at.w_WB[0]
        e1 = body.surface.normal(p)
        approach, weight = float(v @ e1), _pressed(body, p, v - (v @ e1) * e1)
        if e * approach > _LOW * natural or weight < 0:
            world = (p, *route.impact(p, v, w, e, e_t))
            if e * approach > _SEEN * natural:
                events.append(("bounce", time))
            continue
        v, w = route.impact(p, v, w, 0.0, 0.0)
        slip = v + body.ball.radius * np.cross(w, e1)
        slip -= (slip @ e1) * e1
        events.append(("settle", time + 2 * e * approach / ((1 - e) * weight) if e else time))
        size = float(np.linalg.norm(slip))
        return Landed(time, (p, v, w), slip if size > _STANDS * (natural + np.linalg.norm(v)) else None)


def _flight(
    body: RollingBall, world: tuple[FloatArray, FloatArray, FloatArray], time: float, until: float
) -> tuple[float | None, Callable[[FloatArray], BallMotion]]:
    """Free fall from ``time`` [s] with constant spin: when the ball is on the wall again (None: not until the end)."""
    p, v, w = world

    def motion(times: FloatArray) -> BallMotion:
        t = (times - time)[:, None]
        p_WB, v_WB = p + t * v + 0.5 * t**2 * body.gravity, v + t * body.gravity
        return BallMotion(p_WB, v_WB, np.broadcast_to(w, p_WB.shape), np.zeros_like(p_WB), "free flight")

    def sunk(times: FloatArray) -> FloatArray:
        return -body.surface.gap(motion(times).p_WB)

    e1, pull = body.surface.normal(p), float(np.linalg.norm(body.gravity))
    leaving = -float(v @ e1)
    pace = _LEFT * body.ball.radius / (np.sqrt(body.ball.radius * pull) + np.linalg.norm(v) or 1.0)
    if leaving > _LOW * np.sqrt(body.ball.radius * pull):
        # It is in the air for longer than it takes to lose that speed; 0.7, lest a look end where it lands on a plane.
        bend = float(np.linalg.norm(body.surface.normal_gradient(p), 2))
        pace = 0.7 * leaving / (pull + bend * float(v @ v))
    lands, start = None, time + float(pace)
    while lands is None and start < until:  # the gap is a smooth function of the time since: ever longer looks suffice
        end = min(time + 2 * (start - time), until)
        lands, start = first_rise(sunk, start, end), end
    return lands, motion
