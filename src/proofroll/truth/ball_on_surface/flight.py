"""Flights and impacts of a ball, until it stays on the wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface.route import End, Leg, Motion, Path, Route, World
from proofroll.truth.crossing import first_rise

# A ball that leaves the wall is looked for on it from this part of its pace on; its gap has grown from zero till then.
_LEFT = 1e-3


# Parts of the speed of a fall by the radius: bounces slower than the first are over, and only those faster than the
# second, a hundredth of the radius high, are told as events; slower than the third a contact point stands still.
_LOW, _SEEN, _STANDS = 1e-6, 0.14, 1e-12
# Way over the radius of curvature up to which the gap is taken along it: places are rounded by as much as the last
# bounces are high. Points and weights of Gauss on (0, 1) for the mean normal.
_NEAR = 0.01
_POINTS, _WEIGHTS = (1 + np.polynomial.legendre.leggauss(3)[0]) / 2, np.polynomial.legendre.leggauss(3)[1] / 2


def pressed(body: RollingBall, p_WB: FloatArray, v_WB: FloatArray) -> float:
    """Normal force over mass that keeps the centre on its surface [m/s²]."""
    e1, bend = body.surface.normal(p_WB), body.surface.normal_gradient(p_WB)
    return float(e1 @ body.gravity + v_WB @ bend @ v_WB)


@dataclass(frozen=True)
class Landed:
    """A ball that has come to stay on the wall.

    Attributes:
        time: of its last impact that is followed [s].
        settled: of the last of all, since when it stays [s]; the ball goes as far meanwhile as if it stayed before.
        world: its place [m], velocity [m/s] and spin [rad/s] then.
        slip: velocity of its contact point [m/s], shape (3,); None: it rolls.
    """

    time: float
    settled: float
    world: World
    slip: FloatArray | None


def touching(route: Route, landed: Landed) -> FloatArray:
    """The state in which a ball goes on that has landed."""
    state = route.at(*landed.world)
    return state if landed.slip is not None else route.nudged(state, landed.world[1])


def airborne(
    body: RollingBall,
    route: Route,
    world: World,
    time: float,
    until: float,
    path: Path,
) -> Landed | float | None:
    """Flights and impacts from ``time`` on, added to the path, until the ball stays on the wall.

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
        path.legs.append(Leg(time, until if lands is None else lands, False, route.start(), End.TIME, motion))
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
        approach, weight = float(v @ e1), pressed(body, p, v - (v @ e1) * e1)
        if e * approach > _LOW * natural or weight < 0:
            world = (p, *route.impact(body, p, v, w, e, e_t))
            if e * approach > _SEEN * natural:
                path.events.append(("bounce", time))
            continue
        bounced = np.isinf(body.contact.mu_static) and e_t == 1 and 0 < e < 1
        if bounced and _slip(body, v, w, e1) is not None:
            raise Refused(
                f"at about {time:.6g} s the ball comes to stay on the wall after infinitely many bounces, each of "
                "which turns back its contact point whole, so its spin has no limit; "
                "end the run earlier, take tangential_restitution below 1, or give friction a bound (mu_static)"
            )
        v, w = route.impact(body, p, v, w, 0.0, 0.0)
        rest = 2 * e * approach / ((1 - e) * weight) if e else 0.0
        settled = time + rest
        path.events.append(("settle", settled))
        path.blurs[settled] = rest**2 * (natural + np.linalg.norm(v)) * _bend(body, p)  # the weight changes meanwhile
        return Landed(time, settled, (p, v, w), _slip(body, v, w, e1))


def _bend(body: RollingBall, p_WB: FloatArray) -> float:
    """Largest curvature of the centre's surface [1/m]."""
    return float(np.linalg.norm(body.surface.normal_gradient(p_WB), 2))


def _slip(body: RollingBall, v: FloatArray, w: FloatArray, e1: FloatArray) -> FloatArray | None:
    """Velocity of the contact point along the wall [m/s], shape (3,); None: zero but for round-off."""
    a, gravity = body.ball.radius, np.linalg.norm(body.gravity)
    slip = v + a * cross(w, e1)
    slip -= (slip @ e1) * e1
    size = np.linalg.norm(slip)
    return slip if size > _STANDS * (np.sqrt(a * gravity) + np.linalg.norm(v) + a * np.linalg.norm(w)) else None


def _flight(body: RollingBall, world: World, time: float, until: float) -> tuple[float | None, Motion]:
    """Free fall from ``time`` [s] with constant spin: when the ball is on the wall again (None: not until the end)."""
    p, v, w = world

    def way(times: FloatArray) -> FloatArray:
        t = (times - time)[:, None]
        return np.asarray(t * v + 0.5 * t**2 * body.gravity)

    def motion(times: FloatArray) -> BallMotion:
        p_WB, v_WB = p + way(times), v + (times - time)[:, None] * body.gravity
        return BallMotion(p_WB, v_WB, np.broadcast_to(w, p_WB.shape), np.zeros_like(p_WB), "free flight")

    def sunk(times: FloatArray) -> FloatArray:
        whole = way(times)
        near = np.linalg.norm(whole, axis=-1) * bend < _NEAR
        d = np.where(near[:, None], whole, 0.0)
        mean = np.tensordot(_WEIGHTS, body.surface.normal(p + _POINTS[:, None, None] * d), 1)
        return np.where(near, (mean * d).sum(-1) - (0.0 if time else body.gap0), -body.surface.gap(p + whole))

    e1, pull = body.surface.normal(p), float(np.linalg.norm(body.gravity))
    bend = _bend(body, p)
    leaving = -float(v @ e1)
    pace = _LEFT * body.ball.radius / (np.sqrt(body.ball.radius * pull) + np.linalg.norm(v) or 1.0)
    if leaving > _LOW * np.sqrt(body.ball.radius * pull):
        # It is in the air for longer than it takes to lose that speed; 0.7, lest a look end where it lands on a plane.
        pace = 0.7 * leaving / (pull + bend * float(v @ v))
    lands, start = None, time + float(pace)
    while lands is None and start < until:  # the gap is a smooth function of the time since: ever longer looks suffice
        end = min(time + 2 * (start - time), until)
        lands, start = first_rise(sunk, start, end), end
    return lands, motion
