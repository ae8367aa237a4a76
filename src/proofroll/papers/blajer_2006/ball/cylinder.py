"""The inside of a circular cylinder, for the centre of a ball.

It describes itself twice, independently: by a parametrisation (position, tangents, second derivatives; what constraint
models need) and by a signed distance with its derivatives (what contact models need). ``u`` are its two coordinates,
shape (..., 2); array arguments may carry leading dimensions (``...``), e.g. time. Local frame at a point, columns of
:meth:`UprightCylinder.frame`: ``e1`` unit normal, from the ball's centre towards the wall; ``e2`` along the first
coordinate, ``e3 = e1 × e2``.
"""

import math
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, read_only
from proofroll.elements.balls.surfaces import Cylinder

# Matrices on places [m] as rows: projection across the axis, and that projection turned about the axis by 90°.
_ACROSS = np.array([1.0, 1.0, 0.0])
_AROUND = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


class UprightCylinder(Cylinder):
    """A cylinder with the geometry of a ball's centre in it; :meth:`offset` gives the surface of the centre."""

    coordinates = ("gamma", "z")
    periods = (2 * np.pi, None)

    @property
    def length_scales(self) -> tuple[float, float]:
        """Largest distance travelled per unit of each coordinate [m/unit]."""
        return (self.radius, 1.0)

    @property
    def axis(self) -> tuple[float, float, float]:
        """Direction of its axis, which runs through the world's origin."""
        return components(tilted(self.tilt)[:, 2])

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """p_WB: centre of the ball in the world [m], shape (..., 3)."""
        gamma, z = np.moveaxis(np.asarray(u, dtype=np.float64), -1, 0)
        c = self.radius
        return np.stack([c * np.cos(gamma), c * np.sin(gamma), z], axis=-1) @ tilted(self.tilt).T

    def tangents(self, u: npt.ArrayLike) -> FloatArray:
        """∂p/∂u [m/unit], shape (..., 3, 2)."""
        frame = self.frame(u)
        return np.stack([self.radius * frame[..., 1], frame[..., 2]], axis=-1)

    def second(self, u: npt.ArrayLike) -> FloatArray:
        """∂²p/∂u∂u [m/unit²], shape (..., 3, 2, 2)."""
        frame = self.frame(u)
        result = np.zeros((*frame.shape[:-2], 3, 2, 2))
        result[..., 0, 0] = -self.radius * frame[..., 0]
        return result

    def frame(self, u: npt.ArrayLike) -> FloatArray:
        """Local frame with columns e1, e2, e3, shape (..., 3, 3)."""
        gamma = np.asarray(u, dtype=np.float64)[..., 0]
        if gamma.ndim == 0 and math.isfinite(gamma):
            return self._frame(math.cos(gamma), math.sin(gamma))
        cos, sin, zeros, ones = np.cos(gamma), np.sin(gamma), np.zeros_like(gamma), np.ones_like(gamma)
        columns = [
            np.stack([cos, sin, zeros], axis=-1),
            np.stack([-sin, cos, zeros], axis=-1),
            np.stack([zeros, zeros, ones], axis=-1),
        ]
        return np.asarray(tilted(self.tilt) @ np.stack(columns, axis=-1), dtype=np.float64)

    @cached_property
    def _tilted(self) -> tuple[float, float]:
        """Cosine and sine of the tilt."""
        rotation = tilted(self.tilt)
        return float(rotation[0, 0]), float(rotation[0, 2])

    def _frame(self, cos: float, sin: float) -> FloatArray:
        """Local frame at the angle of this cosine and sine, computed without arrays for speed."""
        across, down = self._tilted
        return np.array([[across * cos, -across * sin, down], [sin, cos, 0.0], [-down * cos, down * sin, across]])

    def nearby(self, x: float, y: float, z: float) -> tuple[float, float, float, float]:
        """Gap [m] and the components of e1 at one point, as floats for loops that call it at every step."""
        if not self.tilt:  # upright: fewer products
            distance = math.sqrt(x * x + y * y)
            size = distance or math.nan
            return self.radius - distance, x / size, y / size, 0.0
        across, down = self._tilted
        x = across * x - down * z
        distance = math.sqrt(x * x + y * y)
        cos = x / (distance or math.nan)
        return self.radius - distance, across * cos, y / (distance or math.nan), -down * cos

    def triad(self, x: float, y: float, z: float) -> tuple[float, ...]:
        """Components of e1, e2, e3 at one point, nine floats in this order, for loops that call it at every step."""
        if not self.tilt:  # upright: a third fewer products
            distance = math.sqrt(x * x + y * y) or math.nan
            cos, sin = x / distance, y / distance
            return cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0
        across, down = self._tilted
        x = across * x - down * z
        distance = math.sqrt(x * x + y * y) or math.nan
        cos, sin = x / distance, y / distance
        return across * cos, sin, -down * cos, -across * sin, cos, down * sin, down, 0.0, across

    def _local(self, p_WB: npt.ArrayLike) -> FloatArray:
        return np.asarray(np.asarray(p_WB, dtype=np.float64) @ tilted(self.tilt), dtype=np.float64)

    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Coordinates u of the nearest point, shape (..., 2); a periodic coordinate is in (-period/2, period/2]."""
        if np.ndim(p_WB) == 1:
            x, y, z = np.asarray(p_WB, dtype=np.float64).tolist()
            across, down = self._tilted
            return np.array([math.atan2(y, across * x - down * z), down * x + across * z])
        p = self._local(p_WB)
        return np.stack([np.arctan2(p[..., 1], p[..., 0]), p[..., 2]], axis=-1)

    def gap(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Distance of the ball from the wall [m], shape (...); negative where it has sunk in."""
        if np.ndim(p_WB) == 1:
            return np.asarray(self.nearby(*np.asarray(p_WB).tolist())[0])
        p = self._local(p_WB)
        return np.asarray(self.radius - np.hypot(p[..., 0], p[..., 1]), dtype=np.float64)

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """e1 = -∇gap at any point near the surface, shape (..., 3)."""
        if np.ndim(p_WB) == 1:
            return np.array(self.nearby(*np.asarray(p_WB).tolist())[1:])
        p = self._local(p_WB)
        return np.asarray(p * _ACROSS / np.hypot(p[..., 0], p[..., 1])[..., None] @ tilted(self.tilt).T)

    def normal_gradient(self, p_WB: npt.ArrayLike) -> FloatArray:
        """∂e1/∂p = -∇∇gap [1/m], shape (..., 3, 3)."""
        if np.ndim(p_WB) == 1:
            x, y, z = np.asarray(p_WB).tolist()
            across, down = self._tilted
            x = across * x - down * z
            distance = math.sqrt(x * x + y * y)
            cos, sin = x / (distance or math.nan), y / (distance or math.nan)  # on the axis there is no direction
            ex, ey, ez = -across * sin, cos, down * sin  # e2, along which alone the normal turns
            rows = [[ex * ex, ex * ey, ex * ez], [ey * ex, ey * ey, ey * ez], [ez * ex, ez * ey, ez * ez]]
            return np.array(rows) / distance
        p = self._local(p_WB)
        radial = np.hypot(p[..., 0], p[..., 1])[..., None]
        e2 = p @ _AROUND / radial @ tilted(self.tilt).T  # along which alone the normal turns
        return np.asarray(e2[..., :, None] * (e2 / radial)[..., None, :])


@lru_cache
def tilted(angle: float) -> FloatArray:
    """Rotation by ``angle`` [rad] about the world's y axis, read-only, shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    return read_only(np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]))  # every caller shares it


def components(column: FloatArray) -> tuple[float, float, float]:
    """A vector of shape (3,) as plain floats."""
    return (float(column[0]), float(column[1]), float(column[2]))
