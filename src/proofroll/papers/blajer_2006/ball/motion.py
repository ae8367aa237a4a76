"""Motion of the ball in the world, as every route to the truth returns it."""

from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.papers.blajer_2006.ball.model import RollingBall


@dataclass(frozen=True)
class BallMotion:
    """State and contact force at given times.

    Attributes:
        p_WB, v_WB, w_WB: centre [m], its velocity [m/s], angular velocity [rad/s], shape (time, 3).
        force: of the wall on the ball [N], shape (time, 3).
        route: name of the method that found it, for a person.
    """

    p_WB: FloatArray
    v_WB: FloatArray
    w_WB: FloatArray
    force: FloatArray
    route: str


def world_motion(
    body: RollingBall,
    u: FloatArray,
    *,
    velocity: FloatArray,
    spin: FloatArray,
    friction: FloatArray,
    press: FloatArray,
    route: str,
) -> BallMotion:
    """Motion in the world of rolling at n times, from values in the local frame.

    Args:
        body: the scene's ball.
        u: surface coordinates, shape (n, 2).
        velocity: of the centre along e2, e3 [m/s], shape (n, 2).
        spin: ω1 [rad/s], shape (n,).
        friction: on the ball along e2, e3 [N], shape (n, 2).
        press: normal force N [N], shape (n,).
        route: name of the method, for a person.
    """
    frame = body.surface.frame(u)
    e1, e2, e3 = np.moveaxis(frame, -1, 0)

    def along(x: FloatArray) -> FloatArray:
        return np.asarray(x[:, :1] * e2 + x[:, 1:] * e3)

    v_WB = along(velocity)
    w_WB = spin[:, None] * e1 - cross(e1, v_WB) / body.ball.radius
    return BallMotion(
        p_WB=body.surface.position(u), v_WB=v_WB, w_WB=w_WB, force=along(friction) - press[:, None] * e1, route=route
    )
