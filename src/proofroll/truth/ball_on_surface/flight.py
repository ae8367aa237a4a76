"""Flights and impacts of a ball, until it stays on the wall."""

from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.crossing import first_rise
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface.route import End, Leg, Route, World

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
class Bounce:
    """A ball that leaves its impact.

    Attributes:
        world: its place [m], velocity [m/s] and spin [rad/s] after it.
        seen: it goes high enough to be an event.
    """

    world: World
    seen: bool


@dataclass(frozen=True)
class Landed:
    """A ball that has come to stay on the wall.

    Attributes:
        rest: time from the impact that is the last to be followed to the last of all, since when it stays [s]; it goes
            as far meanwhile as if it stayed.
        blur: uncertainty of that time [s], the same for both routes.
        world: its place [m], velocity [m/s] and spin [rad/s] at the impact that is the last to be followed.
        slip: velocity of its contact point [m/s], shape (3,); None: it rolls.
    """

    rest: float
    blur: float
    world: World
    slip: FloatArray | None


def landed(body: RollingBall, route: Route, flight: Leg) -> Bounce | Landed | None:
    """Outcome of a landing: a bounce, or contact from then on; None: unknown.

    A ball that leaves each impact with e times its speed bounces infinitely often in a finite time: below a speed that
    does not matter (:data:`_LOW`) its last impact takes all of it, which gives the wall the same impulse as all the
    others together.

    Returns:
        None: the contact has no restitution, so nothing is said about what follows.

    Raises:
        Refused: the wall moves, or the spin has no limit.
        Diverged: the flight has no length.
    """
    e, e_t = body.contact.restitution, body.contact.tangential_restitution
    time = flight.end
    if e is None:
        return None
    if body.wall_rate is not None:
        raise Refused(f"the ball lands at t = {time:.9g} s on a wall that moves, which is not followed")
    if not time > flight.start:
        raise Diverged(f"the truth makes no progress at {time:g} s, where the ball bounces")
    natural = np.sqrt(body.ball.radius * np.linalg.norm(body.gravity))
    p, v, w = flight.at_end()
    e1 = body.surface.normal(p)
    approach, weight = float(v @ e1), pressed(body, p, v - (v @ e1) * e1)
    if e * approach > _LOW * natural or weight < 0:
        return Bounce((p, *route.impact(body, p, v, w, e, e_t)), bool(e * approach > _SEEN * natural))
    bounced = np.isinf(body.contact.mu_static) and e_t == 1 and 0 < e < 1
    if bounced and _slip(body, v, w, e1) is not None:
        raise Refused(
            f"at about {time:.6g} s the ball comes to stay on the wall after infinitely many bounces, each of "
            "which turns back its contact point whole, so its spin has no limit; "
            "end the run earlier, take tangential_restitution below 1, or give friction a bound (mu_static)"
        )
    # The last of infinitely many leaves no slip to be turned back; where it is the only one, it does, and friction
    # without bound stops that at once.
    v, w = route.impact(body, p, v, w, 0.0, e_t if e == 0 and np.isfinite(body.contact.mu_static) else 0.0)
    rest = 2 * e * approach / ((1 - e) * weight) if e else 0.0
    blur = rest**2 * (natural + np.linalg.norm(v)) * _bend(body, p)  # the weight changes meanwhile
    return Landed(rest, float(blur), (p, v, w), _slip(body, v, w, e1))


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


def flown(body: RollingBall, world: World, time: float, until: float, state: FloatArray) -> Leg:
    """Free fall from ``time`` [s] with constant spin until the ball is on the wall again, or to ``until`` [s].

    ``state`` is the route's own at take-off; it passes through to the leg, flight uses ``world``.
    """
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
    if lands is None:
        return Leg(time, until, False, state, End.TIME, motion)
    return Leg(time, lands, False, state, End.LANDED, motion)
