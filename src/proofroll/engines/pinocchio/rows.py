"""The rows of rolling and the moment of rolling resistance, in the terms that Pinocchio gives for a joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.surfaces import FloatArray


@dataclass(frozen=True, slots=True)
class BallTerms:
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


def ball_terms(model: Any, data: Any, ball: int, q: FloatArray, v: FloatArray) -> BallTerms:
    """Mass matrix and bias forces into ``data``, and the kinematics of the ball.

    computeAllTerms does not touch ``data.a``, so the drift needs forwardKinematics with a joint acceleration of zero.
    """
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    pin.computeAllTerms(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    return BallTerms(
        pin.getJointJacobian(model, data, ball, pin.LOCAL_WORLD_ALIGNED),
        pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED).vector,
        velocity.linear,
        velocity.angular,
    )


def rolling_rows(
    terms: BallTerms, radius: float, frame: FloatArray, e1_rate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Slip velocity along e2 and e3 as J q̇, and its rate at zero joint acceleration; shapes (2, nv) and (2,).

    Slip is v + a ω × e1, so its components are e2·v + a e3·ω and e3·v - a e2·ω. Its rate has the term a ω × ė1, which
    a row re-posed at each instant would lack.
    """
    e2, e3 = frame[:, 1], frame[:, 2]
    directions = np.empty((2, 6))
    directions[0, :3], directions[0, 3:] = e2, radius * e3
    directions[1, :3], directions[1, 3:] = e3, -radius * e2
    turning = radius * (pin.skew(terms.w) @ e1_rate)
    return directions @ terms.jacobian, directions @ terms.bias + frame[:, 1:].T @ turning


def resistance(terms: BallTerms, f: float, e1: FloatArray) -> FloatArray:
    """Rolling resistance per unit of normal force, on the joints; shape (nv,).

    The moment f e1 × v/V about the centre (Blajer 2006, section 2.4); at V = 0 it has no direction and is zero.
    """
    speed = float(np.linalg.norm(terms.v))
    lever = pin.skew(e1) @ terms.v * (f / speed) if speed > 0 else np.zeros(3)
    return np.asarray(terms.jacobian[3:].T @ lever)
