"""Flight of a ball that has left the wall, until it lands."""

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.event_location import first_rise
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.motion import BallMotion
from proofroll.truth.ball_on_surface.route import BallStretch, End, World

# Fraction of the ball's time scale after take-off at which the search for a landing starts: at take-off itself the gap
# is zero.
_LEFT = 1e-3


# Speed off the wall, relative to sqrt(radius · gravity), above which a landing waits for it.
_LOW = 1e-6
# Displacement times curvature below which the gap is integrated along the displacement: the difference of two positions
# would have a round-off as large as a short flight is high. Gauss points and weights on (0, 1) for the mean normal.
_NEAR = 0.01
_POINTS, _WEIGHTS = (1 + np.polynomial.legendre.leggauss(3)[0]) / 2, np.polynomial.legendre.leggauss(3)[1] / 2


def normal_force_per_mass(body: RollingBall, p_WB: FloatArray, v_WB: FloatArray) -> float:
    """Normal force divided by mass that keeps the centre on its surface [m/s²]."""
    e1, bend = body.surface.normal(p_WB), body.surface.normal_gradient(p_WB)
    return float(e1 @ body.gravity + v_WB @ bend @ v_WB)


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
        return np.where(near, (mean * d).sum(-1), -body.surface.gap(p + whole))

    e1, pull = body.surface.normal(p), float(np.linalg.norm(body.gravity))
    bend = float(np.linalg.norm(body.surface.normal_gradient(p), 2))  # largest curvature [1/m]
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
