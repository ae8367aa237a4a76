"""Walls of revolution about their axis: hole, shaft, bowl, cone and ring."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from typing_extensions import override

from proofroll.elements.mechanism.scene.shapes.walls.curved import CurvedWall
from proofroll.elements.mechanism.scene.shapes.walls.formula import sqrt


@dataclass(frozen=True, eq=False)
class Bore(CurvedWall):
    """Endless cylindrical hole around the axis."""

    radius: float
    kind: ClassVar[str] = "bore"

    @override
    def away(self, x: Any, y: Any, z: Any) -> Any:
        return self.radius - sqrt(x * x + y * y)


@dataclass(frozen=True, eq=False)
class Shaft(CurvedWall):
    """Endless cylinder around the axis."""

    radius: float
    kind: ClassVar[str] = "shaft"

    @override
    def away(self, x: Any, y: Any, z: Any) -> Any:
        return sqrt(x * x + y * y) - self.radius


@dataclass(frozen=True, eq=False)
class EdgeLine(Shaft):
    """Edge of a box, a shaft without radius; ``outward``: normal of a face at it, in the body's frame."""

    outward: Any = None


@dataclass(frozen=True, eq=False)
class BowlWall(CurvedWall):
    """Inside of a sphere about the point."""

    radius: float
    kind: ClassVar[str] = "bowl"

    @override
    def away(self, x: Any, y: Any, z: Any) -> Any:
        return bowl_distance(self.radius, x, y, z)


@dataclass(frozen=True, eq=False)
class ConeWall(CurvedWall):
    """Inside of a cone that opens along the axis, from its tip at the point; ``slope``: from across the axis [rad]."""

    slope: float
    kind: ClassVar[str] = "cone"

    @override
    def away(self, x: Any, y: Any, z: Any) -> Any:
        return cone_distance(self.slope, sqrt(x * x + y * y), z)


@dataclass(frozen=True, eq=False)
class TorusWall(CurvedWall):
    """Outside of a ring of round wire around the axis; ``radius``: of the wire [m]."""

    ring_radius: float
    radius: float
    kind: ClassVar[str] = "torus"

    @override
    def away(self, x: Any, y: Any, z: Any) -> Any:
        return ring_distance(self.ring_radius, self.radius, sqrt(x * x + y * y), z)


def bowl_distance(radius: float, x: Any, y: Any, z: Any) -> Any:
    """Distance inside of a sphere [m], at a place relative to its centre."""
    return radius - sqrt(x * x + y * y + z * z)


def cone_distance(slope: float, r: Any, z: Any) -> Any:
    """Distance inside of a cone [m], at a distance ``r`` from its axis and a height ``z`` above its tip."""
    return z * math.cos(slope) - r * math.sin(slope)


def ring_distance(ring_radius: float, wire_radius: float, r: Any, z: Any) -> Any:
    """Distance from a ring of wire [m], at a distance ``r`` from its axis and a height ``z`` above its middle."""
    across = r - ring_radius
    return sqrt(across * across + z * z) - wire_radius
