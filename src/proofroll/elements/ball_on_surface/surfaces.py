"""Parametrised surfaces on which the centre of a ball moves: the only place that knows geometry.

Each surface gives two independent descriptions of itself: a parametrisation (position, tangents, second
derivatives; what constraint models need) and a signed distance with its derivatives (what contact models need).

Local frame at a point, columns of :meth:`frame`:

* ``e1`` unit normal, from the ball's centre towards the wall,
* ``e2`` along the first coordinate, ``e3 = e1 × e2``.

Array arguments may carry leading dimensions (``...``), e.g. time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from proofroll.core.bounds import bounded
from proofroll.core.errors import InputError

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Generator:
    """One of the two rigid motions that slide a homogeneous surface along itself.

    Attributes:
        kind: ``rotation`` about, or ``translation`` along, a line through the world origin.
        axis: unit direction of that line in the world, shape (3,).
    """

    kind: Literal["rotation", "translation"]
    axis: tuple[float, float, float]


class Surface(Protocol):
    """A surface that guides the centre of a ball. ``u`` are its two coordinates, shape (..., 2)."""

    @property
    def name(self) -> str:
        """Name of the wall in the scene."""

    @property
    def coordinates(self) -> tuple[str, str]:
        """Names of the two coordinates, e.g. ``("gamma", "z")``."""

    @property
    def units(self) -> tuple[str, str]:
        """Units of the two coordinates, e.g. ``("rad", "m")``."""

    @property
    def periods(self) -> tuple[float | None, float | None]:
        """Period of each coordinate after which the point repeats, or None."""

    @property
    def length_scales(self) -> tuple[float, float]:
        """Metres travelled per unit of each coordinate, at most [m/unit]."""

    @property
    def generators(self) -> tuple[Generator, Generator] | None:
        """Motions G1, G2 with p(u) = G1(u1) G2(u2) p(0) and frame(u) alike; None if not homogeneous."""

    def offset(self, ball_radius: float) -> Surface:
        """The surface on which the centre of a touching ball of this radius [m] moves."""

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """p_WB: centre of the ball in the world [m], shape (..., 3)."""

    def tangents(self, u: npt.ArrayLike) -> FloatArray:
        """∂p/∂u [m/unit], shape (..., 3, 2)."""

    def second(self, u: npt.ArrayLike) -> FloatArray:
        """∂²p/∂u∂u [m/unit²], shape (..., 3, 2, 2)."""

    def frame(self, u: npt.ArrayLike) -> FloatArray:
        """Local frame with columns e1, e2, e3, shape (..., 3, 3)."""

    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Coordinates u of the nearest point, shape (..., 2); a periodic coordinate is in (-period/2, period/2]."""

    def gap(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Distance of the ball from the wall [m], shape (...); negative where it has sunk in."""

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """e1 = -∇gap at any point near the surface, shape (..., 3)."""

    def normal_gradient(self, p_WB: npt.ArrayLike) -> FloatArray:
        """∂e1/∂p = -∇∇gap [1/m], shape (..., 3, 3)."""

    def nearby(self, x: float, y: float, z: float) -> tuple[float, float, float, float]:
        """Gap [m] and the components of e1 at one point, for loops that call it at every step."""

    def triad(self, x: float, y: float, z: float) -> tuple[float, ...]:
        """Components of e1, e2, e3 at one point, one after the other; as :meth:`nearby`."""

    def normal_rate(self, p: tuple[float, float, float], v: tuple[float, float, float]) -> tuple[float, float, float]:
        """(∂e1/∂p) v at one point p [m], for its velocity v [m/s]; as :meth:`nearby`."""

    def moving_triad(self, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> tuple[float, ...]:
        """Gap [m], :meth:`triad` and :meth:`normal_rate` [1/s] in one call: 13 numbers, one after the other."""


@lru_cache
def _tilt(angle: float) -> FloatArray:
    """Rotation by ``angle`` [rad] about the world's y axis, read-only, shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    rotation.flags.writeable = False  # every caller shares it
    return rotation


def _axis(column: FloatArray) -> tuple[float, float, float]:
    return (float(column[0]), float(column[1]), float(column[2]))


@dataclass(frozen=True)
class Cylinder:
    """Inside of a circular cylinder; coordinates are the angle γ about its axis and the height z along it.

    Attributes:
        name: by which contacts name it.
        kind: which surface it is.
        radius: radius [m]; of the wall in a scene, of the centre's path after :meth:`offset`.
        tilt: rotation of the axis from the vertical about the world's y axis [rad].
    """

    name: str
    radius: float = field(metadata={"unit": "m"})
    tilt: float = field(default=0.0, metadata={"unit": "rad"})
    kind: Literal["cylinder"] = "cylinder"

    coordinates = ("gamma", "z")
    units = ("rad", "m")
    periods = (2 * np.pi, None)

    def __post_init__(self) -> None:
        """Refuses what is no cylinder.

        Raises:
            OutOfBounds: a radius that is not positive, or a number that is not finite.
        """
        bounded("radius", self.radius, above=0)
        bounded("tilt", self.tilt)

    @property
    def length_scales(self) -> tuple[float, float]:
        """See :class:`Surface`."""
        return (self.radius, 1.0)

    @property
    def generators(self) -> tuple[Generator, Generator]:
        """See :class:`Surface`."""
        axis = _axis(_tilt(self.tilt)[:, 2])
        return (Generator("rotation", axis), Generator("translation", axis))

    def offset(self, ball_radius: float) -> Cylinder:
        """See :class:`Surface`."""
        if not ball_radius < self.radius:
            raise InputError("radius", ball_radius, f"the ball must be smaller than {self.name} with {self.radius:g} m")
        return Cylinder(self.name, self.radius - ball_radius, self.tilt)

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        gamma, z = np.moveaxis(np.asarray(u, dtype=np.float64), -1, 0)
        c = self.radius
        return np.stack([c * np.cos(gamma), c * np.sin(gamma), z], axis=-1) @ _tilt(self.tilt).T

    def tangents(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        frame = self.frame(u)
        return np.stack([self.radius * frame[..., 1], frame[..., 2]], axis=-1)

    def second(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        frame = self.frame(u)
        result = np.zeros((*frame.shape[:-2], 3, 2, 2))
        result[..., 0, 0] = -self.radius * frame[..., 0]
        return result

    def frame(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        gamma = np.asarray(u, dtype=np.float64)[..., 0]
        if gamma.ndim == 0 and math.isfinite(gamma):
            return self._frame(math.cos(gamma), math.sin(gamma))
        cos, sin, zero, one = np.cos(gamma), np.sin(gamma), np.zeros_like(gamma), np.ones_like(gamma)
        columns = [
            np.stack([cos, sin, zero], axis=-1),
            np.stack([-sin, cos, zero], axis=-1),
            np.stack([zero, zero, one], axis=-1),
        ]
        return np.asarray(_tilt(self.tilt) @ np.stack(columns, axis=-1), dtype=np.float64)

    @cached_property
    def _tilted(self) -> tuple[float, float]:
        """Cosine and sine of the tilt."""
        rotation = _tilt(self.tilt)
        return float(rotation[0, 0]), float(rotation[0, 2])

    def _frame(self, cos: float, sin: float) -> FloatArray:
        """The local frame at one angle, without the overhead of arrays."""
        across, down = self._tilted
        return np.array([[across * cos, -across * sin, down], [sin, cos, 0.0], [-down * cos, down * sin, across]])

    def _around(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Distance from the axis [m], and cosine and sine of the angle about it, of one point."""
        across, down = self._tilted
        x = across * x - down * z
        distance = math.sqrt(x * x + y * y)
        size = distance or math.nan  # on the axis there is no direction
        return distance, x / size, y / size

    def nearby(self, x: float, y: float, z: float) -> tuple[float, float, float, float]:
        """See :class:`Surface`."""
        if not self.tilt:  # as in triad
            distance = math.sqrt(x * x + y * y)
            size = distance or math.nan
            return self.radius - distance, x / size, y / size, 0.0
        across, down = self._tilted
        x = across * x - down * z  # as in _around, which would be a third of the cost here
        distance = math.sqrt(x * x + y * y)
        cos = x / (distance or math.nan)
        return self.radius - distance, across * cos, y / (distance or math.nan), -down * cos

    def triad(self, x: float, y: float, z: float) -> tuple[float, ...]:
        """See :class:`Surface`."""
        if not self.tilt:  # upright: the same with a third fewer products
            distance = math.sqrt(x * x + y * y) or math.nan
            cos, sin = x / distance, y / distance
            return cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0
        across, down = self._tilted
        x = across * x - down * z
        distance = math.sqrt(x * x + y * y) or math.nan
        cos, sin = x / distance, y / distance
        return across * cos, sin, -down * cos, -across * sin, cos, down * sin, down, 0.0, across

    def normal_rate(self, p: tuple[float, float, float], v: tuple[float, float, float]) -> tuple[float, float, float]:
        """See :class:`Surface`."""
        across, down = self._tilted
        distance, cos, sin = self._around(*p)
        x, z = -across * sin, down * sin  # with cos, e2: along it alone the normal turns
        rate = (x * v[0] + cos * v[1] + z * v[2]) / (distance or math.nan)
        return rate * x, rate * cos, rate * z

    def moving_triad(self, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> tuple[float, ...]:
        """See :class:`Surface`."""
        across, down = self._tilted
        x = across * x - down * z
        distance = math.sqrt(x * x + y * y) or math.nan
        cos, sin = x / distance, y / distance
        x2, z2 = -across * sin, down * sin
        rate = (x2 * vx + cos * vy + z2 * vz) / distance
        e1_and_e2 = across * cos, sin, -down * cos, x2, cos, z2
        return self.radius - distance, *e1_and_e2, down, 0.0, across, rate * x2, rate * cos, rate * z2

    def _local(self, p_WB: npt.ArrayLike) -> FloatArray:
        return np.asarray(np.asarray(p_WB, dtype=np.float64) @ _tilt(self.tilt), dtype=np.float64)

    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        if np.ndim(p_WB) == 1:
            x, y, z = np.asarray(p_WB, dtype=np.float64).tolist()
            across, down = self._tilted
            return np.array([math.atan2(y, across * x - down * z), down * x + across * z])
        p = self._local(p_WB)
        return np.stack([np.arctan2(p[..., 1], p[..., 0]), p[..., 2]], axis=-1)

    def gap(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        if np.ndim(p_WB) == 1:
            return np.asarray(self.nearby(*np.asarray(p_WB).tolist())[0])
        p = self._local(p_WB)
        return np.asarray(self.radius - np.hypot(p[..., 0], p[..., 1]), dtype=np.float64)

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        if np.ndim(p_WB) == 1:
            return np.array(self.nearby(*np.asarray(p_WB).tolist())[1:])
        p = self._local(p_WB)
        radial = np.stack([p[..., 0], p[..., 1], np.zeros_like(p[..., 0])], axis=-1)
        return np.asarray(radial / np.linalg.norm(radial, axis=-1, keepdims=True) @ _tilt(self.tilt).T)

    def normal_gradient(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        if np.ndim(p_WB) == 1:
            distance, cos, sin = self._around(*np.asarray(p_WB).tolist())
            upright, down = self._tilted
            ex, ey, ez = -upright * sin, cos, down * sin  # e2, along which alone the normal turns
            rows = [[ex * ex, ex * ey, ex * ez], [ey * ex, ey * ey, ey * ez], [ez * ex, ez * ey, ez * ez]]
            return np.array(rows) / distance
        p = self._local(p_WB)
        e1 = self.normal(p_WB)
        axis = _tilt(self.tilt)[:, 2]
        across = np.eye(3) - np.outer(axis, axis) - e1[..., :, None] * e1[..., None, :]
        return np.asarray(across / np.hypot(p[..., 0], p[..., 1])[..., None, None])


@dataclass(frozen=True)
class Plane:
    """Plane through the world's origin; coordinates are the distances down the slope and across it.

    Attributes:
        name: by which contacts name it.
        kind: which surface it is.
        tilt: rotation from the horizontal about the world's y axis [rad]; positive descends along +x.
        height: distance of the ball's centre above the wall's surface [m]; 0 for the wall itself.
    """

    name: str
    tilt: float = field(default=0.0, metadata={"unit": "rad"})
    height: float = field(default=0.0, metadata={"unit": "m"})
    kind: Literal["plane"] = "plane"

    coordinates = ("down", "across")
    units = ("m", "m")
    periods = (None, None)
    length_scales = (1.0, 1.0)

    def __post_init__(self) -> None:
        """Refuses what is no plane.

        Raises:
            OutOfBounds: a number that is not finite.
        """
        bounded("tilt", self.tilt)
        bounded("height", self.height)

    @property
    def generators(self) -> tuple[Generator, Generator]:
        """See :class:`Surface`."""
        frame = self._axes
        return (Generator("translation", _axis(frame[:, 1])), Generator("translation", _axis(frame[:, 2])))

    @cached_property
    def _axes(self) -> FloatArray:
        """Columns e1 (into the plane), e2 (down the slope), e3 = e1 × e2."""
        rotation = _tilt(self.tilt)
        return np.stack([-rotation[:, 2], rotation[:, 0], -rotation[:, 1]], axis=-1)

    @cached_property
    def _e1(self) -> tuple[float, float, float]:
        return _axis(self._axes[:, 0])

    @cached_property
    def _triad(self) -> tuple[float, ...]:
        return tuple(self._axes.T.ravel().tolist())

    def triad(self, x: float, y: float, z: float) -> tuple[float, ...]:  # noqa: ARG002 -- the same everywhere
        """See :class:`Surface`."""
        return self._triad

    def normal_rate(
        self,
        p: tuple[float, float, float],  # noqa: ARG002 -- the same everywhere
        v: tuple[float, float, float],  # noqa: ARG002 -- whatever the velocity
    ) -> tuple[float, float, float]:
        """See :class:`Surface`."""
        return 0.0, 0.0, 0.0

    def moving_triad(
        self,
        x: float,
        y: float,
        z: float,
        vx: float,  # noqa: ARG002 -- whatever the velocity
        vy: float,  # noqa: ARG002
        vz: float,  # noqa: ARG002
    ) -> tuple[float, ...]:
        """See :class:`Surface`."""
        x1, y1, z1 = self._e1
        return -(x * x1 + y * y1 + z * z1) - self.height, *self._triad, 0.0, 0.0, 0.0

    def nearby(self, x: float, y: float, z: float) -> tuple[float, float, float, float]:
        """See :class:`Surface`."""
        x1, y1, z1 = self._e1
        return -(x * x1 + y * y1 + z * z1) - self.height, x1, y1, z1

    def offset(self, ball_radius: float) -> Plane:
        """See :class:`Surface`."""
        return Plane(self.name, self.tilt, self.height + ball_radius)

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        axes = self._axes
        return np.asarray(np.asarray(u, dtype=np.float64) @ axes[:, 1:].T - self.height * axes[:, 0])

    def tangents(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return self.frame(u)[..., 1:]

    def second(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.zeros((*np.shape(u)[:-1], 3, 2, 2))

    def frame(self, u: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.broadcast_to(self._axes, (*np.shape(u)[:-1], 3, 3)).copy()

    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.asarray(np.asarray(p_WB, dtype=np.float64) @ self._axes[:, 1:])

    def gap(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.asarray(-np.asarray(p_WB, dtype=np.float64) @ self._axes[:, 0] - self.height)

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.broadcast_to(self._axes[:, 0], np.shape(p_WB)).copy()

    def normal_gradient(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.zeros((*np.shape(p_WB), 3))


AnySurface = Cylinder | Plane
