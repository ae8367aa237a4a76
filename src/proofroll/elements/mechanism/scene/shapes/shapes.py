"""Shapes that touch: convex ones by their support function, and the walls that these lie on.

A support function gives the farthest point in a direction, and its derivative by the direction. Solids meet each other
with those of their features that are nearest: see :mod:`proofroll.elements.mechanism.scene.shapes.features`.

All coordinates are in the frame of the body that a shape is fixed to.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall


class ConvexShape(Protocol):
    """A convex shape that may touch a plane, given by its support function."""

    @property
    def centre(self) -> Array:
        """Centre of the shape [m], shape (3,)."""

    def support(self, d: Array) -> tuple[Array, Array]:
        """Farthest point in a unit direction [m], shape (3,), and its derivative by the direction, shape (3, 3)."""


@dataclass(frozen=True, eq=False)
class SphereShape:
    """A sphere; a vertex if its radius is 0."""

    centre: Array
    radius: float

    def support(self, d: Array) -> tuple[Array, Array]:
        """See :class:`ConvexShape`."""
        return self.centre + self.radius * d, self.radius * np.eye(3)


@dataclass(frozen=True, eq=False)
class EllipsoidShape:
    """An ellipsoid with semi-axes along the columns of a frame."""

    centre: Array
    axes: Array
    frame: Array

    def support(self, d: Array) -> tuple[Array, Array]:
        """See :class:`ConvexShape`; with Q = F diag(axes²) Fᵀ the point is Q d/√(d·Q d)."""
        Q = (self.frame * self.axes**2) @ self.frame.T
        image = Q @ d
        h = np.sqrt(d @ image)
        return self.centre + image / h, Q / h - np.outer(image, image) / h**3


@dataclass(frozen=True, eq=False)
class CircleShape:
    """A flat disc with a sharp edge; its farthest point along its own normal is not unique."""

    centre: Array
    radius: float
    normal: Array

    def support(self, d: Array) -> tuple[Array, Array]:
        """See :class:`ConvexShape`."""
        across = d - (d @ self.normal) * self.normal
        across -= (across @ self.normal) * self.normal  # of a disc that is almost flat round-off is left
        length = float(np.linalg.norm(across))
        e = across / length if length else across
        flat = np.eye(3) - np.outer(self.normal, self.normal) - np.outer(e, e)
        return self.centre + self.radius * e, self.radius * flat / max(length, np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Half space bounded by a plane through a point [m], on the side opposite to the unit normal."""

    point: Array
    normal: Array


@dataclass(frozen=True, eq=False)
class BoxShape:
    """A solid box with half its edges along the columns of a frame."""

    centre: Array
    half: Array
    frame: Array

    def support(self, d: Array) -> tuple[Array, Array]:
        """See :class:`ConvexShape`; a corner, which does not move with the direction."""
        return self.centre + self.frame @ (self.half * np.where(d @ self.frame < 0, -1.0, 1.0)), np.zeros((3, 3))


@dataclass(frozen=True, eq=False)
class CapsuleShape:
    """A solid capsule; ``half``: from its centre to that of an end [m]."""

    centre: Array
    axis: Array
    half: float
    radius: float

    def support(self, d: Array) -> tuple[Array, Array]:
        """See :class:`ConvexShape`; a point of one of its ends."""
        end = self.centre + float(np.sign(d @ self.axis)) * self.half * self.axis
        return end + self.radius * d, self.radius * np.eye(3)


@dataclass(frozen=True, eq=False)
class CylinderShape:
    """A solid cylinder; ``half``: from its centre to an end [m]."""

    centre: Array
    axis: Array
    half: float
    radius: float

    def support(self, d: Array) -> tuple[Array, Array]:
        """See :class:`ConvexShape`; a point of one of its rims."""
        side = float(np.sign(d @ self.axis)) * self.half
        return CircleShape(self.centre + side * self.axis, self.radius, self.axis).support(d)


Solid = BoxShape | CapsuleShape | CylinderShape
Wall = HalfSpace | CurvedWall
Shape = ConvexShape | Wall
