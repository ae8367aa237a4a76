"""Shapes that touch: convex ones by their support function, and the walls that these lie on.

A support function gives the farthest point in a direction, and how it moves as the direction turns. Solids meet each
other with those of their features that are nearest: see :mod:`proofroll.elements.mechanism.scene.shapes.features`.

All coordinates are in the frame of the body that a shape is fixed to.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from proofroll.elements.mechanism.scene.rotations import (
    Array,
    Floats3,
    minus,
    plain_dot,
    plus,
    scaled,
    square_of,
    turned,
)
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall
from proofroll.elements.mechanism.scene.shapes.walls.formula import sqrt

# Square of a sine far below that of a flat disc or of parallel capsules, which with it have numbers.
LEAST = 1e-32
_STILL = (0.0, 0.0, 0.0)


class ConvexShape(Protocol):
    """A convex shape that may touch a plane, given by its support function."""

    @property
    def centre(self) -> Array:
        """Centre of the shape [m], shape (3,)."""

    def support(self, d: Sequence[Any], rate: Sequence[Any] = _STILL) -> tuple[Floats3, Floats3]:
        """Farthest point in a unit direction [m], and its rate by that of the direction, in floats or symbols."""


@dataclass(frozen=True, eq=False)
class SphereShape:
    """A sphere; a vertex if its radius is 0."""

    centre: Array
    radius: float

    def support(self, d: Sequence[Any], rate: Sequence[Any] = _STILL) -> tuple[Floats3, Floats3]:
        """See :class:`ConvexShape`."""
        return plus(self.centre.tolist(), scaled(self.radius, d)), scaled(self.radius, rate)


@dataclass(frozen=True, eq=False)
class EllipsoidShape:
    """An ellipsoid with semi-axes along the columns of a frame."""

    centre: Array
    axes: Array
    frame: Array

    def support(self, d: Sequence[Any], rate: Sequence[Any] = _STILL) -> tuple[Floats3, Floats3]:
        """See :class:`ConvexShape`; with Q = F diag(axes²) Fᵀ the point is Q d/√(d·Q d)."""
        Q = ((self.frame * self.axes**2) @ self.frame.T).tolist()
        image = turned(Q, d)
        h = sqrt(plain_dot(d, image))
        beside = scaled(plain_dot(image, rate) / (h * h), image)
        return plus(self.centre.tolist(), scaled(1.0 / h, image)), scaled(1.0 / h, minus(turned(Q, rate), beside))


@dataclass(frozen=True, eq=False)
class CircleShape:
    """A flat disc with a sharp edge; its farthest point along its own normal is not unique."""

    centre: Array
    radius: float
    normal: Array

    def support(self, d: Sequence[Any], rate: Sequence[Any] = _STILL) -> tuple[Floats3, Floats3]:
        """See :class:`ConvexShape`."""
        normal = self.normal.tolist()
        across = minus(d, scaled(plain_dot(d, normal), normal))
        across = minus(across, scaled(plain_dot(across, normal), normal))  # of a disc almost flat round-off is left
        inverse = 1.0 / sqrt(square_of(across) + LEAST)
        e = scaled(inverse, across)
        beside = plus(scaled(plain_dot(normal, rate), normal), scaled(plain_dot(e, rate), e))
        return plus(self.centre.tolist(), scaled(self.radius, e)), scaled(self.radius * inverse, minus(rate, beside))


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

    def support(
        self,
        d: Sequence[Any],
        rate: Sequence[Any] = _STILL,  # noqa: ARG002 -- a corner stays
    ) -> tuple[Floats3, Floats3]:
        """See :class:`ConvexShape`; a corner, which does not move with the direction."""
        corner = self.frame @ (self.half * np.where(np.asarray(d) @ self.frame < 0, -1.0, 1.0))
        return plus(self.centre.tolist(), corner.tolist()), _STILL


@dataclass(frozen=True, eq=False)
class CapsuleShape:
    """A solid capsule; ``half``: from its centre to that of an end [m]."""

    centre: Array
    axis: Array
    half: float
    radius: float

    def support(self, d: Sequence[Any], rate: Sequence[Any] = _STILL) -> tuple[Floats3, Floats3]:
        """See :class:`ConvexShape`; a point of one of its ends."""
        end = self.centre + float(np.sign(np.asarray(d) @ self.axis)) * self.half * self.axis
        return SphereShape(end, self.radius).support(d, rate)


@dataclass(frozen=True, eq=False)
class CylinderShape:
    """A solid cylinder; ``half``: from its centre to an end [m]."""

    centre: Array
    axis: Array
    half: float
    radius: float

    def support(self, d: Sequence[Any], rate: Sequence[Any] = _STILL) -> tuple[Floats3, Floats3]:
        """See :class:`ConvexShape`; a point of one of its rims."""
        side = float(np.sign(np.asarray(d) @ self.axis)) * self.half
        return CircleShape(self.centre + side * self.axis, self.radius, self.axis).support(d, rate)


Solid = BoxShape | CapsuleShape | CylinderShape
Wall = HalfSpace | CurvedWall
Shape = ConvexShape | Wall
