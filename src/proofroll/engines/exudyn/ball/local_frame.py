"""Cylinders: their derivatives in the local frame, which are the same at every place."""

import math
from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.surfaces import Cylinder

# Speed, in units of sqrt(a g), below which the moment of rolling resistance falls to zero with the speed: Newton's
# method fails at the jump of its direction at rest. It lets a ball roll too far by the square of this, 4e-6.
_SLOW = 2e-3


@dataclass(frozen=True)
class LocalGeometry:
    """A cylinder in its own local frame e1, e2, e3, where its derivatives are constant.

    Attributes:
        tangents: ∂p/∂u [m/unit], shape (3, 2).
        second: ∂²p/∂u∂u [m/unit²], shape (3, 2, 2).
        turn: angular velocity of the frame per rate of u [rad/unit], shape (3, 2).
    """

    tangents: FloatArray
    second: FloatArray
    turn: FloatArray


def local_geometry(surface: Cylinder) -> LocalGeometry:
    """Constant local coefficients of a cylinder of the centre's path; the frame turns about its axis, along e3."""
    c, second = surface.radius, np.zeros((3, 2, 2))
    second[0, 0, 0] = -c
    tangents = np.array([[0.0, 0.0], [c, 0.0], [0.0, 1.0]])
    return LocalGeometry(tangents, second, turn=np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]))


def curvature(surface: Cylinder, u0: FloatArray) -> FloatArray:
    """∂e1/∂p along e2 and e3 in the local frame [1/m], symmetric, shape (2, 2); the same everywhere if homogeneous."""
    frame = surface.frame(u0)
    return np.asarray((frame.T @ surface.normal_gradient(surface.position(u0)) @ frame)[1:, 1:])


def slow(body: RollingBall) -> float:
    """Speed of the centre [m/s] below which the rolling resistance is proportional to it."""
    return _SLOW * math.sqrt(body.ball.radius * float(np.linalg.norm(body.gravity)))
