"""Geometry of the surface in local axes e1, e2, e3, as the projection method needs it.

The frame F has the columns e1 (normal, towards the wall), e2 (along the first coordinate) and e3 = e1 × e2.
"""

import math
from collections.abc import Sequence

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder

Vector = tuple[float, float, float]


# e1, e2, e3 in the world, one after the other: the columns of F.
Frame = tuple[float, ...]


def matrix(frame: Frame) -> FloatArray:
    """Frame F as a matrix, shape (3, 3)."""
    return np.array(frame).reshape(3, 3).T


def along(frame: Frame, x: float, y: float, z: float) -> Vector:
    """Components along e1, e2, e3 of a vector in world axes."""
    x1, y1, z1, x2, y2, z2, x3, y3, z3 = frame
    return x1 * x + y1 * y + z1 * z, x2 * x + y2 * y + z2 * z, x3 * x + y3 * y + z3 * z


def in_world(frame: Frame, a: float, b: float, c: float) -> Vector:
    """Components in world axes of a vector along e1, e2, e3."""
    x1, y1, z1, x2, y2, z2, x3, y3, z3 = frame
    return x1 * a + x2 * b + x3 * c, y1 * a + y2 * b + y3 * c, z1 * a + z2 * b + z3 * c


class Uniform:
    """A cylinder: all its points are alike, and the frame at u is the one at u = 0 turned about e3, the axis.

    Attributes:
        radius: of the cylinder in which the centre moves [m].
    """

    def __init__(self, surface: UprightCylinder) -> None:
        start, self.radius = surface.frame((0.0, 0.0)), surface.radius
        k1, k2, k3 = surface.axis
        cross = np.array([[0.0, -k3, k2], [k3, 0.0, -k1], [-k2, k1, 0.0]])
        # F0, F1, F2 of the frame F0 + sin α F1 + (1 - cos α) F2 at the coordinate α (Rodrigues).
        self._parts = [(part @ start).T.ravel().tolist() for part in (np.eye(3), cross, cross @ cross)]

    def at(self, u: Sequence[float]) -> Frame:
        """Frame at a position; the first number of ``u`` is the angle."""
        angle = u[0]
        if not math.isfinite(angle):
            raise FloatingPointError("the place on the surface is not finite")
        sin, back = math.sin(angle), 1.0 - math.cos(angle)
        # Written out: a loop over the nine makes a whole evaluation a tenth slower.
        (x1, y1, z1, x2, y2, z2, x3, y3, z3), once, twice = self._parts
        a1, b1, c1, a2, b2, c2, a3, b3, c3 = once
        d1, e1, f1, d2, e2, f2, d3, e3, f3 = twice
        return (
            x1 + sin * a1 + back * d1,
            y1 + sin * b1 + back * e1,
            z1 + sin * c1 + back * f1,
            x2 + sin * a2 + back * d2,
            y2 + sin * b2 + back * e2,
            z2 + sin * c2 + back * f2,
            x3 + sin * a3 + back * d3,
            y3 + sin * b3 + back * e3,
            z3 + sin * c3 + back * f3,
        )
