"""Coordinates on walls: where the centre of a sphere that touches a wall is, and its local frame there.

The wall's axes are those of its surroundings, turned the shortest way that brings z to its axis or normal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from proofroll.core.arrays import cross, read_only
from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.rotations import Array, from_z
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, Wall
from proofroll.elements.mechanism.scene.shapes.walls.curved import CurvedWall
from proofroll.elements.mechanism.scene.shapes.walls.declared import Declared, DeclaredWall
from proofroll.elements.mechanism.scene.shapes.walls.formula import cos, differentiated, sin
from proofroll.elements.mechanism.scene.shapes.walls.of_revolution import Bore, BowlWall, ConeWall, Shaft, TorusWall

_UPPER = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]  # places of a symmetric matrix in its upper half, row by row
_ROUND = 2 * math.pi


@dataclass(frozen=True)
class WallChart:
    """Two coordinates of the centre of a sphere that touches a wall, as formulas in the wall's axes.

    Formulas are in arithmetic and the functions of :mod:`proofroll.elements.mechanism.scene.shapes.walls.formula`.

    Attributes:
        radius: of the sphere [m].
    """

    radius: float

    coordinates: ClassVar[tuple[str, str]] = ("gamma", "z")
    units: ClassVar[tuple[str, str]] = ("rad", "m")
    periods: ClassVar[tuple[float | None, float | None]] = (_ROUND, None)

    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        """Centre at these coordinates [m]."""
        raise NotImplementedError

    def gap(self, x: Any, y: Any, z: Any) -> Any:
        """Distance of a sphere with this centre from the wall [m]."""
        raise NotImplementedError

    def locate(self, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        """Coordinates of the nearest centre of a sphere that touches; an angle is in (-π, π]."""
        raise NotImplementedError

    def scales(self, u1: float, u2: float) -> tuple[float, float]:  # noqa: ARG002 -- of those that vary
        """Way per unit of each coordinate at a place [m/unit]."""
        return 1.0, 1.0


@dataclass(frozen=True)
class OnPlane(WallChart):
    """Distances along x, down a slope, and against y, across it."""

    coordinates = ("down", "across")
    units = ("m", "m")
    periods = (None, None)

    @override
    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        return u1, -1.0 * u2, self.radius

    @override
    def gap(self, x: Any, y: Any, z: Any) -> Any:
        return z - self.radius

    @override
    def locate(self, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        return x, -y


@dataclass(frozen=True)
class OnCurve(WallChart):
    """Coordinates on a wall of revolution."""

    wall: CurvedWall

    @override
    def gap(self, x: Any, y: Any, z: Any) -> Any:
        return self.wall.away(x, y, z) - self.radius


@dataclass(frozen=True)
class OnBore(OnCurve):
    """Angle about the axis of a hole or a shaft, and height along it."""

    @property
    def round_radius(self) -> float:
        """Radius of the cylinder of the centre [m]."""
        wall = self.wall
        assert isinstance(wall, Bore | Shaft)  # by `_CHARTS`
        return wall.radius - self.radius if isinstance(wall, Bore) else wall.radius + self.radius

    @override
    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        return self.round_radius * cos(u1), self.round_radius * sin(u1), u2

    @override
    def locate(self, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        return np.arctan2(y, x), z

    @override
    def scales(self, u1: float, u2: float) -> tuple[float, float]:
        return self.round_radius, 1.0


@dataclass(frozen=True)
class OnBowl(OnCurve):
    """Stereographic projection from the top of the centre's sphere; at its bottom xi is along x, eta against y."""

    coordinates = ("xi", "eta")
    units = ("m", "m")
    periods = (None, None)

    @property
    def _size(self) -> float:
        assert isinstance(self.wall, BowlWall)  # by `_CHARTS`
        return self.wall.radius - self.radius

    @override
    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        x, y = u1 / (2 * self._size), u2 / (2 * self._size)
        square = x * x + y * y
        size = self._size / (1.0 + square)
        return 2.0 * x * size, -2.0 * y * size, (square - 1.0) * size

    @override
    def locate(self, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        below = np.sqrt(x * x + y * y + z * z) - z
        return 2 * self._size * x / below, -2 * self._size * y / below


@dataclass(frozen=True)
class OnCone(OnCurve):
    """Angle about the axis, and way along the wall from the tip of the centre's cone."""

    coordinates = ("gamma", "s")

    @property
    def _slope(self) -> tuple[float, float, float]:
        """Cosine and sine of the slope, height of the tip of the centre's cone [m]."""
        assert isinstance(self.wall, ConeWall)  # by `_CHARTS`
        across, up = math.cos(self.wall.slope), math.sin(self.wall.slope)
        return across, up, self.radius / across

    @override
    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        across, up, tip = self._slope
        return u2 * across * cos(u1), u2 * across * sin(u1), u2 * up + tip

    @override
    def locate(self, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        across, up, tip = self._slope
        return np.arctan2(y, x), np.hypot(x, y) * across + (z - tip) * up

    @override
    def scales(self, u1: float, u2: float) -> tuple[float, float]:
        return abs(u2) * self._slope[0], 1.0


@dataclass(frozen=True)
class OnTorus(OnCurve):
    """Angle about the axis of a ring, and angle around its wire from its top, outward."""

    coordinates = ("gamma", "theta")
    units = ("rad", "rad")
    periods = (_ROUND, _ROUND)

    @property
    def _radii(self) -> tuple[float, float]:
        """Radii of the ring, and of the torus of the centre around its wire [m]."""
        assert isinstance(self.wall, TorusWall)  # by `_CHARTS`
        return self.wall.ring_radius, self.wall.radius + self.radius

    @override
    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        ring, wire = self._radii
        r = wire * sin(u2) + ring
        return r * cos(u1), r * sin(u1), wire * cos(u2)

    @override
    def locate(self, x: Any, y: Any, z: Any) -> tuple[Any, Any]:
        return np.arctan2(y, x), np.arctan2(np.hypot(x, y) - self._radii[0], z)

    @override
    def scales(self, u1: float, u2: float) -> tuple[float, float]:
        return sum(self._radii), self._radii[1]


_CHARTS: dict[str, type[OnCurve]] = {"bore": OnBore, "shaft": OnBore, "bowl": OnBowl, "cone": OnCone, "torus": OnTorus}


@dataclass(frozen=True, eq=False)
class WallCoordinates:
    """Coordinates of the centre of a sphere on a wall that stands in the world, and the local frame there.

    Columns of :meth:`frame`: e1, the unit normal from the centre to the wall; e2, along the first coordinate; e3 =
    e1 × e2. Arrays of places may have any shape (..., 3), of coordinates (..., 2).

    Attributes:
        chart: the coordinates in the wall's axes.
        origin: place of the wall [m], shape (3,).
        axis: its axis or normal, a unit vector, shape (3,).
    """

    chart: WallChart
    origin: Array
    axis: Array

    @property
    def coordinates(self) -> tuple[str, str]:
        """Names of the coordinates."""
        return self.chart.coordinates

    @property
    def units(self) -> tuple[str, str]:
        """Units of the coordinates."""
        return self.chart.units

    @property
    def periods(self) -> tuple[float | None, float | None]:
        """Period of each coordinate, or None."""
        return self.chart.periods

    @cached_property
    def axes(self) -> Array:
        """The wall's axes in the world, as columns."""
        return read_only(from_z(self.axis))

    def position(self, u: npt.ArrayLike) -> Array:
        """Centre in the world [m], shape (..., 3)."""
        return self.origin + self._derivatives(u, 0, 1)[..., 0] @ self.axes.T

    def tangents(self, u: npt.ArrayLike) -> Array:
        """Its derivatives [m/unit], shape (..., 3, 2)."""
        return self.axes @ self._derivatives(u, 1, 2)

    def second(self, u: npt.ArrayLike) -> Array:
        """Its second derivatives [m/unit²], shape (..., 3, 2, 2)."""
        second = self.axes @ self._derivatives(u, 3, 3)
        return np.asarray(second[..., [[0, 1], [1, 2]]])

    def frame(self, u: npt.ArrayLike) -> Array:
        """Local frame with columns e1, e2, e3, shape (..., 3, 3)."""
        tangent = self.tangents(u)[..., 0]
        e1, e2 = self.normal(self.position(u)), tangent / np.linalg.norm(tangent, axis=-1, keepdims=True)
        return np.stack([e1, e2, cross(e1, e2)], axis=-1)

    def scales(self, u1: float, u2: float) -> tuple[float, float]:
        """Way per unit of each coordinate at a place [m/unit]."""
        return self.chart.scales(u1, u2)

    def locate(self, p_WB: npt.ArrayLike) -> Array:
        """Coordinates of the nearest centre that touches, shape (..., 2); angles in (-π, π]."""
        return np.stack(self.chart.locate(*self._local(p_WB)), axis=-1)

    def gap(self, p_WB: npt.ArrayLike) -> Array:
        """Distance of the sphere from the wall [m], shape (...)."""
        return np.asarray(self.chart.gap(*self._local(p_WB)))

    def normal(self, p_WB: npt.ArrayLike) -> Array:
        """e1, minus the gradient of the gap, shape (..., 3)."""
        return np.asarray(-self._gradients(p_WB, 1, 3) @ self.axes.T)

    def normal_gradient(self, p_WB: npt.ArrayLike) -> Array:
        """Gradient of e1 [1/m], shape (..., 3, 3)."""
        return np.asarray(self.axes @ -self._gradients(p_WB, 4, 6)[..., _UPPER] @ self.axes.T)

    def _local(self, p_WB: npt.ArrayLike) -> tuple[Array, ...]:
        """Components of places in the wall's axes [m]."""
        return tuple(np.moveaxis((np.asarray(p_WB, dtype=np.float64) - self.origin) @ self.axes, -1, 0))

    def _derivatives(self, u: npt.ArrayLike, lowest: int, count: int) -> Array:
        """Derivatives of the centre in the wall's axes: value, two first, three second; shape (..., 3, count)."""
        u = np.asarray(u, dtype=np.float64)
        parts = _point(self.chart)(u[..., 0], u[..., 1])
        columns = [parts[6 * axis + number] for axis in range(3) for number in range(lowest, lowest + count)]
        return _stacked(columns, u.shape[:-1]).reshape(*u.shape[:-1], 3, count)

    def _gradients(self, p_WB: npt.ArrayLike, lowest: int, count: int) -> Array:
        """Derivatives of the gap in the wall's axes: value, gradient, upper half of the Hessian; shape (..., count)."""
        parts = _gap(self.chart)(*self._local(p_WB))
        return _stacked(parts[lowest : lowest + count], np.shape(p_WB)[:-1])


def wall_coordinates(
    wall: Wall, radius: float, turned: Array | None = None, moved: Array | None = None
) -> WallCoordinates | Declared:
    """Coordinates of the centres of spheres of a radius [m] that touch a wall.

    Args:
        wall: in the frame of its body.
        radius: of the spheres [m].
        turned: rotation of that frame in the world, shape (3, 3); None: not turned.
        moved: its origin in the world [m], shape (3,); None: not moved.

    Raises:
        InputError: no coordinates of such a wall are known, or a sphere has no room in it.
    """
    if isinstance(wall, DeclaredWall):
        return wall.surface.offset(radius)
    rotation, origin = np.eye(3) if turned is None else turned, np.zeros(3) if moved is None else moved
    if isinstance(wall, HalfSpace):
        return WallCoordinates(OnPlane(radius), origin + rotation @ wall.point, rotation @ wall.normal)
    if wall.kind not in _CHARTS:
        raise InputError(
            "kind", wall.kind, f"no coordinates of such a wall are known; those of {', '.join(_CHARTS)} are"
        )
    chart = _CHARTS[wall.kind](radius, wall)
    return WallCoordinates(chart, origin + rotation @ wall.point, rotation @ wall.axis)


@lru_cache
def _point(chart: WallChart) -> Callable[..., Any]:
    return differentiated(chart.point, 2)[1]


@lru_cache
def _gap(chart: WallChart) -> Callable[..., Any]:
    return differentiated(chart.gap, 3)[1]


def _stacked(parts: list[Any], shape: tuple[int, ...]) -> Array:
    """Numbers or arrays of this shape as one array with a further last axis."""
    return np.stack([np.broadcast_to(np.asarray(part, dtype=np.float64), shape) for part in parts], axis=-1)
