"""Geometry of the surface in local axes e1, e2, e3, as the projection method needs it.

The frame F has the columns e1 (normal, towards the wall), e2 (along the first coordinate) and e3 = e1 × e2.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder

Vector = tuple[float, float, float]


class Shape(NamedTuple):
    """Derivatives of the position and of the frame along e1, e2, e3, as plain numbers.

    Attributes:
        tangents: Fᵀ ∂p/∂u [m/unit]: along e2 for both coordinates, then along e3; zero along e1.
        inverse: inverse of the tangents as a matrix [unit/m]: first coordinate for e2 and e3, then the second.
        second: Fᵀ ∂²p/∂u∂u as factors of u̇², u̇v̇ and v̇² [m/unit²]: along e1, e2, e3.
        turning: angular velocity of the frame per rate of the first coordinate, and of the second [1/unit].
    """

    tangents: tuple[float, ...]
    inverse: tuple[float, ...]
    second: tuple[float, ...]
    turning: tuple[float, ...]


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


@dataclass(frozen=True)
class GeneralSurface:
    """Any surface, evaluated at each point from its tangents and second derivatives.

    The frame comes from the surface. Its rate of turning follows from the definition: e2 is along the first tangent,
    and ∂e1 · t = -e1 · ∂t for every tangent t, because e1 · t = 0.
    """

    surface: UprightCylinder

    def at(self, place: Sequence[float]) -> tuple[Frame, Shape]:
        """Frame and shape at a position; the first two numbers of ``place`` are the coordinates."""
        u = np.array(place[:2])
        frame = self.surface.frame(u)
        tangents = frame.T @ self.surface.tangents(u)
        second = np.tensordot(frame.T, self.surface.second(u), axes=1)
        turning = np.zeros((3, 3, 2))
        turning[1:, 0] = -np.linalg.solve(tangents[1:].T, second[0])  # e2, e3 components of ∂e1
        turning[2, 1] = second[2, 0] / tangents[1, 0]  # e3 component of ∂e2; its e1 component follows by skewness
        turning = turning - turning.swapaxes(0, 1)
        products = np.stack([second[:, 0, 0], second[:, 0, 1] + second[:, 1, 0], second[:, 1, 1]], axis=1)
        axes = np.stack([turning[2, 1], turning[0, 2], turning[1, 0]], axis=1)  # axes of these skew matrices
        parts = tangents[1:], np.linalg.inv(tangents[1:]), products, axes
        return tuple(frame.T.ravel().tolist()), Shape(*(tuple(part.ravel().tolist()) for part in parts))


class Uniform:
    """A cylinder: all its points are alike.

    All geometry is constant in local axes, and the frame at u is the one at u = 0 turned about the axis.
    """

    def __init__(self, surface: UprightCylinder) -> None:
        self._start = GeneralSurface(surface).at((0.0, 0.0))
        k1, k2, k3 = surface.axis
        cross = np.array([[0.0, -k3, k2], [k3, 0.0, -k1], [-k2, k1, 0.0]])
        # F0, F1, F2 of the frame F0 + sin α F1 + (1 - cos α) F2 at the coordinate α (Rodrigues).
        self._parts = [(part @ matrix(self._start[0])).T.ravel().tolist() for part in (np.eye(3), cross, cross @ cross)]

    def at(self, u: Sequence[float]) -> tuple[Frame, Shape]:
        """See :meth:`GeneralSurface.at`."""
        angle = u[0]
        if not math.isfinite(angle):
            raise FloatingPointError("the place on the surface is not finite")
        sin, back = math.sin(angle), 1.0 - math.cos(angle)
        # Written out: a loop over the nine makes a whole evaluation a tenth slower.
        (x1, y1, z1, x2, y2, z2, x3, y3, z3), once, twice = self._parts
        a1, b1, c1, a2, b2, c2, a3, b3, c3 = once
        d1, e1, f1, d2, e2, f2, d3, e3, f3 = twice
        frame = (
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
        return frame, self._start[1]
