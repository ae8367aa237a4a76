"""Curvature of the cylinder in the local frame, and the speed below which rolling resistance falls to zero."""

import math

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder
from proofroll.papers.blajer_2006.ball.model import RollingBall

# Speed, in units of sqrt(a g), below which the moment of rolling resistance falls to zero with the speed: Newton's
# method fails at the jump of its direction at rest. It lets a ball roll too far by the square of this, 4e-6.
_SLOW = 2e-3


def curvature(surface: UprightCylinder, u0: FloatArray) -> FloatArray:
    """∂e1/∂p along e2 and e3 in the local frame [1/m], symmetric, shape (2, 2); the same everywhere if homogeneous."""
    frame = surface.frame(u0)
    return np.asarray((frame.T @ surface.normal_gradient(surface.position(u0)) @ frame)[1:, 1:])


def slow(body: RollingBall) -> float:
    """Speed of the centre [m/s] below which the rolling resistance is proportional to it."""
    return _SLOW * math.sqrt(body.ball.radius * float(np.linalg.norm(body.gravity)))
