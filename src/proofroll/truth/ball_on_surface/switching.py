"""The sequence of sticking and slipping, whatever integrates each leg of it.

A leg is a stretch of time in one mode. A :class:`Route` integrates one leg at a time and says why it ended; here is
decided what comes next. Nothing limits the number of legs: only the end of time ends the sequence.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.ball_on_surface.mechanics import natural_acceleration, setting_off, stands, stays
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface.flight import Landed, airborne, pressed, touching
from proofroll.truth.ball_on_surface.route import End, Leg, Path, Route

# Relative distance from the friction cone below which round-off decides on which side a state is; round-off is 1e-15.
_ON_CONE = 1e-12
# Normal force at time 0, relative to the natural one, below which the ball is off the wall and not at its round-off.
_OFF_WALL = 1e-12
# Part of the natural speed at which a ball that goes back and forth ever less is taken to be at rest: it has some 1e-9
# of the natural time to go, and 1e-18 of the way. Reversals much smaller than that drown in the round-off of the time.
_AT_REST = 1e-9
# As many slips in a row, each shorter than the one before by more than a part of it, are followed on the way there;
# each costs both routes the search for the place where the direction of the resistance jumps.
_REVERSALS = 10
_SHORTER = 1e-6


def follow(body: RollingBall, route: Route, until: float) -> Path:  # noqa: PLR0912, PLR0915 -- one per end
    """Path from time 0 to ``until`` [s].

    Raises:
        Refused: the ball slips to and fro ever faster.
        Diverged: a route makes no progress.
    """
    path = Path()
    legs, events = path.legs, path.events
    reversals = 0
    time, begins, state = 0.0, 0.0, route.start()
    if not body.gap0 and stands(body, route.world(state)[1]):
        if stays(body, route.world(state)[0]):
            return Path([_rest(body, route, state, time, until)], events)
        state = route.nudged(state, setting_off(body, route.world(state)[0]))
    slip = body.slip0 if np.any(body.slip0) else None
    falls = not body.gap0 and pressed(body, *route.world(state)[:2]) < -_OFF_WALL * natural_acceleration(body)
    if falls:
        events.append(("lift_off", time))
    flight = (body.p0, body.v0, body.w0) if falls or body.gap0 else None
    sticking: bool | None = None  # it has just begun to touch the wall
    while True:
        if flight is not None:
            came = airborne(body, route, flight, time, until, path)
            if not isinstance(came, Landed):
                return replace(path, lands=came)
            time, begins, slip, state = came.time, came.settled, came.slip, touching(route, came)
            flight, sticking = None, None
        if sticking is None:
            sticking = slip is None and not _must_slip(body, route, state)
            if not sticking:
                events.append(("slip", max(time, begins)))
        leg = route.stick(time, state, until) if sticking else route.slip(time, state, until, slip)
        slip = None
        legs.append(leg)
        if not leg.end > time and leg.why is not End.TIME and len(legs) > 1 and legs[-2].end == legs[-2].start:
            raise Diverged(f"the truth makes no progress at {time:g} s, where sticking and slipping alternate at once")
        time, state = leg.end, leg.state
        if leg.why is End.TIME:
            return path
        if leg.why is End.LIFTOFF:
            events.append(("lift_off", time))
            last = leg.motion(np.array([time]))  # with the slip that a state does not tell
            flight = last.p_WB[0], last.v_WB[0], last.w_WB[0]
            continue
        if _comes_to_rest(body, route, leg):
            if not sticking:
                events.append(("stick", max(time, begins)))
            legs.append(_rest(body, route, route.nudged(state, np.zeros(3)), time, until))
            return path
        if leg.why is End.HALT:
            state = route.nudged(state, setting_off(body, route.world(state)[0]))
        hastens = len(legs) > 1 and leg.end - leg.start < (1 - _SHORTER) * (legs[-2].end - legs[-2].start)
        reversals = reversals + 1 if leg.why is End.STILL and not sticking and hastens else 0
        if reversals > _REVERSALS:
            raise Refused(
                f"from about {time:.6g} s on the ball slips to and fro ever faster, for resistance stops the rolling "
                "before friction stops the centre; end the run earlier, or take more friction or less resistance"
            )
        # With |u| = 0 the ball sticks if it can; where the needed force is outside the cone it goes on slipping.
        must_slip = leg.why is End.CONE or _must_slip(body, route, state)
        if must_slip and sticking:
            events.append(("slip", max(time, begins)))
        elif not must_slip and not sticking:
            events.append(("stick", max(time, begins)))
        sticking = not must_slip


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


def _comes_to_rest(body: RollingBall, route: Route, leg: Leg) -> bool:
    """True if the ball stops at the end of a leg and can rest there: its centre, or all but round-off of a slip.

    Where resistance slows the rolling faster than friction the centre, the ball slips to a stop, rolls back a part of
    the way and so on: on a level plane infinitely often in a finite time, each time by the same part.
    """
    p, v, _ = route.world(leg.state)
    speed = np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)) + np.linalg.norm(body.v0)
    settled = leg.why is End.STILL and np.linalg.norm(v) <= _AT_REST * speed
    return body.contact.rolling_resistance > 0 and bool(leg.why is End.HALT or settled) and stays(body, p)


def _rest(body: RollingBall, route: Route, state: FloatArray, time: float, until: float) -> Leg:
    p, _, w = route.world(state)
    e1 = body.surface.normal(p)
    force = -body.ball.mass * body.gravity

    def motion(times: FloatArray) -> BallMotion:
        p_WB, v_WB, w_WB, held = (np.broadcast_to(x, (len(times), 3)) for x in (p, np.zeros(3), (w @ e1) * e1, force))
        return BallMotion(p_WB, v_WB, w_WB, held, "at rest")

    return Leg(time, until, True, state, End.TIME, motion)
