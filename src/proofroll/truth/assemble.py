"""What several routes share: from local quantities to the motion in the world, and one classic step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray
from proofroll.truth.motion import Motion


def world_motion(
    body: RollingBall,
    u: FloatArray,
    *,
    velocity: FloatArray,
    spin: FloatArray,
    slip: FloatArray,
    friction: FloatArray,
    press: FloatArray,
    route: str,
) -> Motion:
    """Motion at n times.

    Args:
        body: the scene's ball.
        u: surface coordinates, shape (n, 2).
        velocity: of the centre along e2, e3 [m/s], shape (n, 2).
        spin: ω1 [rad/s], shape (n,).
        slip: velocity of the contact point along e2, e3 [m/s], shape (n, 2).
        friction: on the ball along e2, e3 [N], shape (n, 2).
        press: N [N], shape (n,).
        route: for a person.
    """
    frame = body.surface.frame(u)
    e1, e2, e3 = np.moveaxis(frame, -1, 0)

    def along(x: FloatArray) -> FloatArray:
        return np.asarray(x[:, :1] * e2 + x[:, 1:] * e3)

    v_WB = along(velocity)
    # slip = v + a ω × e1, so the tangential part of ω is e1 × (slip - v) / a
    w_WB = spin[:, None] * e1 + np.cross(e1, along(slip) - v_WB) / body.ball.radius
    return Motion(body.surface.position(u), v_WB, w_WB, along(friction) - press[:, None] * e1, route)


def joined(
    times: FloatArray, change: float, early: Callable[[FloatArray], Motion], late: Callable[[FloatArray], Motion]
) -> Motion:
    """Motion at rising times: by ``early`` before the time ``change`` [s] and by ``late`` from then on."""
    first = int(np.searchsorted(times, change))
    parts = early(times[:first]), late(times[first:])
    p, v, w, force = (
        np.concatenate([getattr(part, key) for part in parts]) for key in ("p_WB", "v_WB", "w_WB", "force")
    )
    return Motion(p, v, w, force, parts[1].route)


def classic_step(rates: Callable[[FloatArray], FloatArray], state: FloatArray, span: float) -> FloatArray:
    """The state after ``span`` [s] by one classic Runge-Kutta step; for looking a little ahead."""
    k1 = rates(state)
    k2 = rates(state + span / 2 * k1)
    k3 = rates(state + span / 2 * k2)
    k4 = rates(state + span * k3)
    return np.asarray(state + span / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
