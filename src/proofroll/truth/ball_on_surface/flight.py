"""Flights and impacts of a ball, until it stays on the wall."""

from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.errors import Diverged, Refused
from proofroll.core.event_location import first_rise
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface.route import BallStretch, End, Route, World

# Fraction of the ball's time scale after take-off at which the search for a landing starts: at take-off itself the gap
# is zero.
_LEFT = 1e-3


# Speeds relative to sqrt(radius · gravity). Bounces slower than _LOW are not followed; only those faster than _SEEN (a
# hundredth of the radius high) are reported as events. A contact point slower than _STANDS (times all speeds of the
# ball) is at rest.
_LOW, _SEEN, _STANDS = 1e-6, 0.14, 1e-12
# Displacement times curvature below which the gap is integrated along the displacement: the difference of two positions
# would have a round-off as large as the last bounces are high. Gauss points and weights on (0, 1) for the mean normal.
_NEAR = 0.01
_POINTS, _WEIGHTS = (1 + np.polynomial.legendre.leggauss(3)[0]) / 2, np.polynomial.legendre.leggauss(3)[1] / 2


def normal_force_per_mass(body: RollingBall, p_WB: FloatArray, v_WB: FloatArray) -> float:
    """Normal force divided by mass that keeps the centre on its surface [m/s²]."""
    e1, bend = body.surface.normal(p_WB), body.surface.normal_gradient(p_WB)
    return float(e1 @ body.gravity + v_WB @ bend @ v_WB)


@dataclass(frozen=True)
class Rebound:
    """State after an impact from which the ball leaves the wall again.

    Attributes:
        world: position [m], velocity [m/s] and spin [rad/s] after the impact.
        seen: the bounce is high enough to be an event.
    """

    world: World
    seen: bool


@dataclass(frozen=True)
class Landed:
    """State of a ball that stays on the wall.

    Attributes:
        rest: time from the last followed impact to the end of all further ones [s]; meanwhile the ball moves as if it
            was in contact.
        blur: uncertainty of that time [s], the same for both routes.
        world: position [m], velocity [m/s] and spin [rad/s] at the last followed impact.
        slip: velocity of the contact point [m/s], shape (3,); None: it rolls.
    """

    rest: float
    blur: float
    world: World
    slip: FloatArray | None


def landing_outcome(body: RollingBall, route: Route, flight: BallStretch) -> Rebound | Landed | None:
    """Outcome of a landing: a bounce, or lasting contact.

    A ball that leaves each impact with e times its speed bounces infinitely often in a finite time. Below the speed
    :data:`_LOW` a single impact with e = 0, of the same total impulse, replaces all that remain.

    Returns:
        None if the contact has no coefficient of restitution: the continuation is unknown.

    Raises:
        Refused: the wall moves, or the spin has no limit.
        Diverged: the flight has zero length.
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
    approach, weight = float(v @ e1), normal_force_per_mass(body, p, v - (v @ e1) * e1)
    if e * approach > _LOW * natural or weight < 0:
        return Rebound((p, *route.impact(body, p, v, w, e, e_t)), bool(e * approach > _SEEN * natural))
    bounced = np.isinf(body.contact.mu_static) and e_t == 1 and 0 < e < 1
    if bounced and _slip(body, v, w, e1) is not None:
        raise Refused(
            f"at about {time:.6g} s the ball comes to stay on the wall after infinitely many bounces, each of "
            "which reverses the velocity of its contact point, so its spin alternates for ever; "
            "end the run earlier, take tangential_restitution below 1, or give friction a bound (mu_static)"
        )
    # Infinitely many impacts (e > 0) leave no slip, as with e_t = 0. A single impact (e = 0) reverses the slip by e_t,
    # unless unbounded friction stops it at once.
    v, w = route.impact(body, p, v, w, 0.0, e_t if e == 0 and np.isfinite(body.contact.mu_static) else 0.0)
    rest = 2 * e * approach / ((1 - e) * weight) if e else 0.0
    blur = rest**2 * (natural + np.linalg.norm(v)) * _bend(body, p)  # the normal force changes during ``rest``
    return Landed(rest, float(blur), (p, v, w), _slip(body, v, w, e1))


def _bend(body: RollingBall, p_WB: FloatArray) -> float:
    """Largest curvature of the surface of the ball's centre [1/m]."""
    return float(np.linalg.norm(body.surface.normal_gradient(p_WB), 2))


def _slip(body: RollingBall, v: FloatArray, w: FloatArray, e1: FloatArray) -> FloatArray | None:
    """Velocity of the contact point along the wall [m/s], shape (3,); None: zero within round-off."""
    a, gravity = body.ball.radius, np.linalg.norm(body.gravity)
    slip = v + a * cross(w, e1)
    slip -= (slip @ e1) * e1
    size = np.linalg.norm(slip)
    return slip if size > _STANDS * (np.sqrt(a * gravity) + np.linalg.norm(v) + a * np.linalg.norm(w)) else None


def fly(body: RollingBall, world: World, time: float, until: float, state: FloatArray) -> BallStretch:
    """Free fall from ``time`` [s] with constant spin until the ball lands, or to ``until`` [s].

    ``world``: position, velocity and spin at take-off. ``state``: the same in the route's variables, handed on to the
    stretch.
    """
    p, v, w = world

    def way(times: FloatArray) -> FloatArray:
        t = (times - time)[:, None]
        return np.asarray(t * v + 0.5 * t**2 * body.gravity)

    def motion(times: FloatArray) -> BallMotion:
        p_WB, v_WB = p + way(times), v + (times - time)[:, None] * body.gravity
        return BallMotion(
            p_WB=p_WB, v_WB=v_WB, w_WB=np.broadcast_to(w, p_WB.shape), force=np.zeros_like(p_WB), route="free flight"
        )

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
        # The flight lasts longer than gravity and curvature need to cancel the speed ``leaving``. Search intervals
        # double; the factor 0.7 keeps their ends off the landing time on a plane.
        pace = 0.7 * leaving / (pull + bend * float(v @ v))
    lands, start = None, time + float(pace)
    while lands is None and start < until:  # intervals may double: the gap is a smooth function of time
        end = min(time + 2 * (start - time), until)
        lands, start = first_rise(sunk, start, end), end
    if lands is None:
        return BallStretch(start=time, end=until, sticking=False, state=state, why=End.TIME, motion=motion)
    return BallStretch(start=time, end=lands, sticking=False, state=state, why=End.LANDED, motion=motion)
