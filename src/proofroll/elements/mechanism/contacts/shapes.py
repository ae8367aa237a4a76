"""Shapes that touch: convex ones by their support function, and the walls that these lie on.

A support function gives the farthest point in a direction, and its derivative by the direction.

All coordinates are in the frame of the body that a shape is fixed to.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from proofroll.elements.mechanism.contacts.walls import CurvedWall
from proofroll.elements.mechanism.rotations import Array


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
        along = Q @ d
        h = np.sqrt(d @ along)
        return self.centre + along / h, Q / h - np.outer(along, along) / h**3


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


Wall = HalfSpace | CurvedWall
Shape = ConvexShape | Wall
