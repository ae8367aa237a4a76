"""The rows of rolling and the moment of rolling resistance, in the terms that Pinocchio gives for a joint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray

Triple = list[float] | tuple[float, float, float]


class BallTerms(NamedTuple):
    """Kinematics of the ball's joint now, in world axes, at the ball's centre.

    Attributes:
        jacobian: of (v, ω) with respect to the joint velocities, shape (6, nv).
        bias: acceleration of the centre [m/s²] and of the spin [rad/s²] while joint accelerations are zero, shape (6,).
        v: of the centre [m/s], shape (3,).
        w: angular velocity [rad/s], shape (3,).
    """

    jacobian: FloatArray
    bias: FloatArray
    v: FloatArray
    w: FloatArray


def ball_terms(model: Any, data: Any, ball: int, q: FloatArray, v: FloatArray, rest: FloatArray) -> BallTerms:
    """Mass matrix and bias forces into ``data``, and the kinematics of the ball.

    computeAllTerms does not touch ``data.a``, so the drift needs forwardKinematics with a joint acceleration of zero,
    which is ``rest``.
    """
    pin.forwardKinematics(model, data, q, v, rest)
    pin.computeAllTerms(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    return BallTerms(
        pin.getJointJacobian(model, data, ball, pin.LOCAL_WORLD_ALIGNED),
        pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED).vector,
        velocity.linear,
        velocity.angular,
    )


def rolling_directions(radius: float, triad: Sequence[float]) -> FloatArray:
    """Slip velocity along e2 and e3 from (v, ω) of the ball, shape (2, 6).

    Slip is v + a ω × e1, so its components are e2·v + a e3·ω and e3·v - a e2·ω.

    Args:
        radius: a [m].
        triad: components of e1, e2, e3, one after the other.
    """
    _, _, _, x2, y2, z2, x3, y3, z3 = triad
    a = radius
    return np.array([[x2, y2, z2, a * x3, a * y3, a * z3], [x3, y3, z3, -a * x2, -a * y2, -a * z2]])


def rolling_rows(
    terms: BallTerms, radius: float, triad: Sequence[float], e1_rate: Triple
) -> tuple[FloatArray, FloatArray]:
    """Slip velocity along e2 and e3 as J q̇, and its rate at zero joint acceleration; shapes (2, nv) and (2,).

    Its rate has the term a ω × ė1, which a row re-posed at each instant would lack.

    Args:
        terms: of the ball.
        radius: a [m].
        triad: components of e1, e2, e3, one after the other.
        e1_rate: ė1 [1/s].
    """
    # Plain floats: numpy's overhead on three numbers is that of all that Pinocchio computes here.
    _, _, _, x2, y2, z2, x3, y3, z3 = triad
    a = radius
    directions = rolling_directions(a, triad)
    x, y, z = cross(terms.w.tolist(), e1_rate)
    drift = directions.dot(terms.bias)
    drift[0] += a * (x2 * x + y2 * y + z2 * z)
    drift[1] += a * (x3 * x + y3 * y + z3 * z)
    return directions.dot(terms.jacobian), drift


def own_bias(model: Any, data: Any, ball: int, q: FloatArray, v: FloatArray, rest: FloatArray) -> FloatArray:
    """As :func:`ball_terms`, the bias alone, in the axes of the ball's joint."""
    pin.forwardKinematics(model, data, q, v, rest)
    pin.crba(model, data, q)
    pin.nonLinearEffects(model, data, q, v)
    return pin.getClassicalAcceleration(model, data, ball, pin.LOCAL).vector  # type: ignore[no-any-return]  # it is an array


def own_jacobian(model: Any, ball: int, q: FloatArray) -> FloatArray:
    """Of (v, ω) of the ball with respect to the joint velocities, in the axes of its joint; shape (6, nv)."""
    return np.array(pin.computeJointJacobian(model, model.createData(), q, ball))


def cross(x: Triple, y: Triple) -> tuple[float, float, float]:
    """Vector product of two vectors of three components."""
    x0, x1, x2 = x
    y0, y1, y2 = y
    return x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0


def resistance(terms: BallTerms, f: float, e1: FloatArray) -> FloatArray:
    """Rolling resistance per unit of normal force, on the joints; shape (nv,).

    The moment f e1 × v/V about the centre (Blajer 2006, section 2.4); at V = 0 it has no direction and is zero.
    """
    speed = math.hypot(*terms.v.tolist())
    lever = np.array(cross(e1.tolist(), terms.v.tolist())) * (f / speed) if speed > 0 else np.zeros(3)
    return np.asarray(terms.jacobian[3:].T.dot(lever))
