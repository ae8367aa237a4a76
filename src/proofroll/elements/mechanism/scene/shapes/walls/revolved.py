"""Surfaces of revolution about the world's z axis, from a profile curve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.shapes.walls.declared import Declared
from proofroll.elements.mechanism.scene.shapes.walls.formula import Jet, cos, sin, sqrt, variables

# Number of start points along a curve for the search of the nearest point, of Newton steps, and relative tolerance.
_PLACES, _NEWTON, _ROUND_OFF = 65, 30, 1e-15


class Revolved(Declared):
    """A profile curve in the half-plane of radius r and height z, turned about the axis by the angle gamma.

    A subclass defines :meth:`profile` and ``extent``, and for speed, where formulas are known, :meth:`away`,
    :meth:`along` and :meth:`offset`. The second coordinate runs along the curve with the ball to its left, seen with r
    to the right and z upwards.
    """

    units: tuple[str, str] = ("rad", "m")
    periods: tuple[float | None, float | None] = (2 * math.pi, None)

    @property
    def extent(self) -> tuple[float, float]:
        """(least, greatest) of the second coordinate, in which the surface is checked and drawn."""
        raise NotImplementedError

    def profile(self, s: Any) -> tuple[Any, Any]:
        """Radius and height [m] of the point of the curve with the second coordinate ``s``."""
        raise NotImplementedError

    def away(self, r: Any, z: Any) -> Any:
        """Distance from the curve [m], positive on the side of balls."""
        return Declared.distance(self, r, 0.0, z)

    def along(self, r: FloatArray, z: FloatArray) -> FloatArray:
        """Second coordinate of the nearest point of the curve: Newton's method, from the nearest of many points."""
        r, z = np.broadcast_arrays(r, z)
        low, high = self.extent
        samples = low + (high - low) * (np.arange(_PLACES) + 0.5) / _PLACES
        at_r, at_z = (np.broadcast_to(part, samples.shape) for part in self.profile(samples))
        s = samples[np.argmin((r[..., None] - at_r) ** 2 + (z[..., None] - at_z) ** 2, axis=-1)]
        for _ in range(_NEWTON):
            (r0, r1, r2), (z0, z1, z2) = (_derivatives(part) for part in self.profile(variables(s)[0]))
            off_r, off_z = r0 - r, z0 - z
            step = (off_r * r1 + off_z * z1) / (r1 * r1 + z1 * z1 + off_r * r2 + off_z * z2)
            s = s - step
            if np.all(np.abs(step) <= _ROUND_OFF * (high - low)):
                break
        period = self.periods[1]
        return np.asarray(s if period is None else s - period * np.ceil(s / period - 0.5))

    @override
    def offset(self, ball_radius: float) -> Revolved:
        return Parallel(self, ball_radius)

    @property
    @override
    def knows_distance(self) -> bool:
        return type(self).away is not Revolved.away

    @property
    @override
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        return (-math.pi, math.pi), self.extent

    @override
    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        r, z = self.profile(u2)
        return r * cos(u1), r * sin(u1), z

    @override
    def distance(self, x: Any, y: Any, z: Any) -> Any:
        return self.away(sqrt(x * x + y * y), z)

    @override
    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        x, y, z = np.moveaxis(np.asarray(p_WB, dtype=np.float64), -1, 0)
        return np.stack([np.arctan2(y, x), self.along(np.hypot(x, y), z)], axis=-1)


def _derivatives(part: Any) -> tuple[Any, Any, Any]:
    """Value, first and second derivative of a function of one variable."""
    return (part.value, part.first[0], part.second[0]) if isinstance(part, Jet) else (part, 0.0, 0.0)


@dataclass(frozen=True)
class Parallel(Revolved):
    """Surface at a constant distance from a surface of revolution, with the coordinates of the nearest point there.

    Attributes:
        of: the surface of revolution.
        apart: the distance [m], towards the balls.
    """

    of: Revolved
    apart: float

    def __post_init__(self) -> None:
        """Copies names and periods of the surface; raises InputError if the surface curves more than the ball."""
        for key in ("name", "kind", "coordinates", "units", "periods"):
            object.__setattr__(self, key, getattr(self.of, key))
        bends = float(np.linalg.eigvalsh(self.of.normal_gradient(self.of.position(self.of.places()))).max())
        if not bends * self.apart < 1:
            raise InputError(
                "radius", self.apart, f"the ball must be smaller than {self.name}'s curve, {1 / bends:g} m"
            )

    @property
    @override
    def extent(self) -> tuple[float, float]:
        return self.of.extent

    @property
    @override
    def knows_distance(self) -> bool:
        return self.of.knows_distance

    @override
    def offset(self, ball_radius: float) -> Parallel:
        return Parallel(self.of, self.apart + ball_radius)

    def profile(self, s: Any) -> tuple[Any, Any]:
        """See :class:`Revolved`; the point of the original curve, moved along its normal."""
        (r, r_slope, _), (z, z_slope, _) = (_derivatives(part) for part in self.of.profile(variables(s)[0]))
        by = self.apart / sqrt(r_slope * r_slope + z_slope * z_slope)
        return r - z_slope * by, z + r_slope * by

    @override
    def away(self, r: Any, z: Any) -> Any:
        return self.of.away(r, z) - self.apart

    @override
    def along(self, r: FloatArray, z: FloatArray) -> FloatArray:
        return self.of.along(r, z)
