"""Law check of a ball that rolls evenly: its routes at points of short pieces of the motion, against the laws."""

from collections.abc import Callable

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.truth.check.laws.integrals import COUNT, POINTS, integral
from proofroll.truth.check.laws.motion import laws_of_pieces
from proofroll.truth.check.laws.record import Modes, Pieces, stated
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import LawScene

# Pieces of a motion that are looked at, and the turn of the ball in each [rad], which their points resolve.
_PIECES, _TURN = 8, 0.5
# Turn of the ball [rad] up to which they lie: after more the rounding of the time alone is felt inside a piece.
_SPAN = 1e5
# Matrix of the integrals from the start of a piece to each of its points, for a pace of 1.
_INTEGRALS = integral(np.eye(COUNT)[None], np.ones((1, COUNT)))[0]

Route = Callable[[RollingBall, FloatArray], BallMotion]


def checked_motion(
    element: MechanismElement, ball: RollingBall, route: Route, times: FloatArray, *, coarse: bool
) -> tuple[BallMotion, LawResiduals]:
    """Motion of a route at rising times [s], and what the laws leave of it.

    The pieces lie evenly over the motion, if that is not too long. No route follows the orientation, so the one of the
    check is the integral of the spin; all else is what the route states.

    Args:
        element: mechanism of the ball.
        ball: the ball.
        route: integrates from the first time on.
        times: at least one.
        coarse: True if states between steps are known to fewer digits than at their ends.

    Raises:
        Diverged: the route could not be integrated.
    """
    rate = element.speed / element.length
    scene, residuals = LawScene(element.mechanism, element.length, rate), LawResiduals(rate=rate)
    start, end = float(times[0]), float(times[-1])
    fastest = float(np.linalg.norm(route(ball, times).w_WB, axis=-1).max())
    if not np.isfinite(fastest):
        return route(ball, times), residuals
    length = min(_TURN / fastest, end - start) if fastest else end - start
    if not length:
        return route(ball, times), residuals
    starts = np.linspace(start, min(end - length, start + length * _SPAN / _TURN), _PIECES)
    points = starts[:, None] + length * (POINTS + 1) / 2
    together = np.unique(np.concatenate([times, points.ravel()]))
    motion = route(ball, together)
    at_points = _at(motion, np.searchsorted(together, points.ravel()))
    laws_of_pieces(scene, _pieces(element, ball, at_points, points, coarse), residuals)
    return _at(motion, np.searchsorted(together, times)), residuals


def _at(motion: BallMotion, index: np.ndarray[tuple[int], np.dtype[np.int64]]) -> BallMotion:
    """A motion at some of its times."""
    return BallMotion(
        p_WB=motion.p_WB[index],
        v_WB=motion.v_WB[index],
        w_WB=motion.w_WB[index],
        force=motion.force[index],
        route=motion.route,
    )


def _pieces(element: MechanismElement, ball: RollingBall, motion: BallMotion, time: FloatArray, coarse: bool) -> Pieces:
    """Record of a motion at the points of pieces, whose times have the shape (pieces, points)."""
    assert element.on_wall is not None  # by ``covers``
    shape, sign, resistance = time.shape, element.on_wall.sign, ball.contact.rolling_resistance
    joints = len(element.mechanism.joints)
    outward = ball.surface.normal(motion.p_WB)
    pace = np.repeat((time[:, -1:] - time[:, :1]) / 2, COUNT, axis=1)
    w = motion.w_WB.reshape(*shape, 3)
    moment = np.zeros_like(outward)
    if resistance:
        press = -np.sum(motion.force * outward, axis=-1, keepdims=True)
        speed = np.linalg.norm(motion.v_WB, axis=-1, keepdims=True)
        direction = np.divide(motion.v_WB, speed, out=np.zeros_like(motion.v_WB), where=speed > 0)
        moment = resistance * press * cross(direction, -outward)

    def of_ball(values: FloatArray) -> FloatArray:
        """Vectors (times, 3) of the ball, and zero for the world."""
        return np.stack([values, np.zeros_like(values)], axis=1).reshape(*shape, 2, 3)

    def of_contact(values: FloatArray) -> FloatArray:
        return values.reshape(*shape, 1, 3)

    turned = np.stack([_orientation(w, pace), np.broadcast_to(np.eye(3), (*shape, 3, 3))], axis=2)
    modes = Modes(
        contacts=("stick",),
        rolling=("slip" if resistance else "open",),
        spinning=("open",),
        friction=("open",) * joints,
        stops=(("open", "open"),) * joints,
    )
    return stated(
        element.mechanism,
        modes,
        time,
        pace=pace,
        p=of_ball(motion.p_WB),
        R=turned,
        v=of_ball(motion.v_WB),
        w=of_ball(motion.w_WB),
        force=of_contact(sign * motion.force),
        place=of_contact(motion.p_WB + ball.ball.radius * outward),
        normal=of_contact(-sign * outward),
        rolling=of_contact(sign * moment),
        coarse=coarse,
    )


def _orientation(w: FloatArray, pace: FloatArray) -> FloatArray:
    """Rotation matrices from the start of each piece on, by collocation at its points; w (pieces, points, 3)."""
    from scipy.spatial.transform import Rotation  # half a second, which truths of other scenes do not need

    pieces, points, _ = w.shape
    x, y, z = np.moveaxis(w, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -x, -y, -z], [x, zero, -z, y], [y, z, zero, -x], [z, -y, x, zero]]
    rates = np.moveaxis(np.array(rows), (0, 1), (2, 3)) / 2 * pace[..., None, None]  # of a quaternion, scalar first
    matrices = np.einsum("kn,snij->sknij", _INTEGRALS, rates).transpose(0, 1, 3, 2, 4).reshape(pieces, 4 * points, -1)
    starts = np.tile([1.0, 0.0, 0.0, 0.0], points)
    turned = np.linalg.solve(np.eye(4 * points) - matrices, np.tile(starts, (pieces, 1))[..., None])
    rotations = Rotation.from_quat(turned.reshape(-1, 4), scalar_first=True).as_matrix()
    return np.asarray(rotations.reshape(pieces, points, 3, 3))
