"""Sequence of rolling, slipping, flight and rest of a ball, for any route.

A :class:`Route` integrates one stretch at a time and reports why it ended; this module decides what comes next.
:func:`proofroll.truth.numerics.hybrid.follow` chains the stretches.
"""

import math
from dataclasses import dataclass
from typing import cast

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.events import EventKind
from proofroll.elements.ball_on_surface.mechanics import (
    can_rest,
    natural_acceleration,
    resistance_undirected,
    setting_off,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface.flight import fly, normal_force_per_mass
from proofroll.truth.ball_on_surface.route import BallStretch, End, Path, Route, World
from proofroll.truth.numerics import hybrid
from proofroll.truth.numerics.hybrid import Transition

# Relative distance from the friction cone below which round-off (1e-15) decides on which side a state is.
_ON_CONE = 1e-12
# Normal force at time 0, relative to the natural one, below which the ball is off the wall beyond round-off.
_OFF_WALL = 1e-12
# Speed relative to the natural one at which a ball that rocks ever less counts as at rest: it has some 1e-9 of the
# natural time to go, and 1e-18 of the length. Much smaller reversals drown in the round-off of the time.
_AT_REST = 1e-9
# Successive slips that are followed when each is shorter than the one before by more than the fraction _SHORTER; each
# costs both routes a search for the place where the rolling resistance changes direction.
_REVERSALS = 10
_SHORTER = 1e-6


@dataclass(frozen=True)
class Mode:
    """Mode of a ball's motion during a stretch: flight, rolling, slip or rest.

    Attributes:
        flight: position [m], velocity [m/s] and spin [rad/s] at the start of a flight; None: the ball touches the wall.
        sticking: True if the ball rolls without slip, or rests.
        rests: nothing moves except a spin about the normal.
    """

    flight: World | None = None
    sticking: bool = False
    rests: bool = False


ROLLS = Mode(sticking=True)
RESTS = Mode(sticking=True, rests=True)


def follow(body: RollingBall, route: Route, until: float) -> Path:
    """Path from time 0 to ``until`` [s], or to an earlier time from which the motion is not known.

    Raises:
        Refused, Diverged: no motion is known from time 0 on.
    """
    path = hybrid.follow(SwitchedBall(body, route), until)
    events = [(cast(EventKind, event.kind), event.time) for event in path.happenings]
    end = math.inf if path.known else path.stretches[-1].end
    return Path(list(path.stretches), events, end=end, ended=path.ended)


class SwitchedBall:
    """Stretches of a ball by one route; implements :class:`proofroll.truth.numerics.hybrid.SwitchingRoute`."""

    def __init__(self, body: RollingBall, route: Route) -> None:
        self.body, self.route = body, route
        self._reversals, self._spans = 0, (0.0, 0.0)  # durations of the last two stretches [s]

    def begin(self) -> Transition[Mode]:
        """See the protocol."""
        body, route, state = self.body, self.route, self.route.start()
        if resistance_undirected(body, body.v0):
            if can_rest(body, body.p0):
                return Transition(state, RESTS, ())
            state = route.nudged(state, setting_off(body, body.p0))
        if normal_force_per_mass(body, body.p0, body.v0) < -_OFF_WALL * natural_acceleration(body):
            return Transition(state, Mode(flight=(body.p0, body.v0, body.w0)), ((EventKind.LIFT_OFF, ""),))
        if _must_slip(body, route, state):
            return Transition(state, Mode(), ((EventKind.SLIP, ""),))
        return Transition(state, ROLLS, ())

    def walk(self, time: float, state: FloatArray, mode: Mode, until: float) -> BallStretch:
        """See the protocol."""
        if mode.flight is not None:
            stretch = fly(self.body, mode.flight, time, until, state)
        elif mode.rests:
            stretch = _rest(self.body, self.route, state, time, until)
        elif mode.sticking:
            stretch = self.route.stick(time, state, until)
        else:
            stretch = self.route.slip(time, state, until)
        self._spans = self._spans[1], stretch.end - stretch.start
        return stretch

    def change(self, stretch: BallStretch) -> Transition[Mode]:
        """See the protocol."""
        body, route, state = self.body, self.route, stretch.state
        if stretch.why is End.LANDED:
            return Transition(stretch.state, None, ())
        if stretch.why is End.LIFTOFF:
            # ``at_end`` includes the slip, which the state lacks.
            return Transition(route.start(), Mode(flight=stretch.at_end()), ((EventKind.LIFT_OFF, ""),))
        if _comes_to_rest(body, route, stretch):
            stopped = () if stretch.sticking else ((EventKind.STICK, ""),)
            return Transition(route.nudged(state, np.zeros(3)), RESTS, stopped)
        if stretch.why is End.HALT:
            state = route.nudged(state, setting_off(body, route.world(state)[0]))
        last_span, span = self._spans
        hastens = stretch.why is End.STILL and not stretch.sticking and span < (1 - _SHORTER) * last_span
        self._reversals = self._reversals + 1 if hastens else 0
        if self._reversals > _REVERSALS:
            raise Refused(
                f"from about {stretch.end:.6g} s on the ball slips to and fro ever faster: resistance stops the "
                "rolling before friction stops the centre; "
                "end the run earlier, or take more friction or less resistance"
            )
        # At |u| = 0 the ball sticks if the needed friction is inside the cone; otherwise it goes on slipping.
        slips = stretch.why is End.CONE or _must_slip(body, route, state)
        if slips != stretch.sticking:
            return Transition(state, Mode() if slips else ROLLS, ())
        return Transition(state, Mode() if slips else ROLLS, ((EventKind.SLIP if slips else EventKind.STICK, ""),))


def _must_slip(body: RollingBall, route: Route, state: FloatArray) -> bool:
    """True if the needed friction is outside the static cone, or on it and about to leave."""
    if not np.isfinite(body.contact.mu_static):
        return False
    excess = route.excess(state)
    if abs(excess) > _ON_CONE:
        return excess > 0
    a, speed = body.ball.radius, float(np.linalg.norm(route.world(state)[1]))
    pace = np.sqrt(a * np.linalg.norm(body.gravity)) + speed
    return bool(pace > 0 and route.excess(route.ahead(state, 1e-3 * a / pace)) > _ON_CONE)


def _comes_to_rest(body: RollingBall, route: Route, stretch: BallStretch) -> bool:
    """True if a ball with rolling resistance stops at the end of a stretch and can stay there.

    It stops when its centre stops in rolling, or when a slip ends with all but no velocity. Where resistance slows the
    spin faster than friction slows the centre, the ball slips to a stop, rolls back part of the way, slips again and so
    on: on a level plane infinitely often in a finite time, each time shorter by the same factor.
    """
    p, v, _ = route.world(stretch.state)
    speed = np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)) + np.linalg.norm(body.v0)
    settled = stretch.why is End.STILL and np.linalg.norm(v) <= _AT_REST * speed
    return body.contact.rolling_resistance > 0 and bool(stretch.why is End.HALT or settled) and can_rest(body, p)


def _rest(body: RollingBall, route: Route, state: FloatArray, time: float, until: float) -> BallStretch:
    p, _, w = route.world(state)
    e1 = body.surface.normal(p)
    force = -body.ball.mass * body.gravity

    def motion(times: FloatArray) -> BallMotion:
        p_WB, v_WB, w_WB, wall = (np.broadcast_to(x, (len(times), 3)) for x in (p, np.zeros(3), (w @ e1) * e1, force))
        return BallMotion(p_WB=p_WB, v_WB=v_WB, w_WB=w_WB, force=wall, route="at rest")

    return BallStretch(start=time, end=until, sticking=True, state=state, why=End.TIME, motion=motion)
