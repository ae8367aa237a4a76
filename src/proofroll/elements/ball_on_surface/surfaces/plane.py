"""A plane, at rest or turning as a turntable."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, read_only
from proofroll.core.bounds import require_bounds
from proofroll.elements.ball_on_surface.surfaces.surface import Generator, components, tilted


@dataclass(frozen=True)
class Plane:
    """Plane through the world's origin; coordinates are the distances down the slope and across it.

    Attributes:
        name: used by contacts.
        kind: name of the surface in scene files.
        tilt: rotation from the horizontal about the world's y axis [rad]; positive descends along +x.
        height: distance of the ball's centre above the wall's surface [m]; 0 for the wall itself.
        turning: rate of a turntable, about the normal through the world's origin, upwards [rad/s].
    """

    name: str
    tilt: float = field(default=0.0, metadata={"unit": "rad"})
    height: float = field(default=0.0, metadata={"unit": "m"})
    turning: float = field(default=0.0, metadata={"unit": "rad/s"})
    kind: Literal["plane"] = "plane"

    coordinates = ("down", "across")
    units = ("m", "m")
    periods = (None, None)
    length_scales = (1.0, 1.0)

    def __post_init__(self) -> None:
        require_bounds("tilt", self.tilt)
        require_bounds("height", self.height)
        require_bounds("turning", self.turning)

    @property
    def generators(self) -> tuple[Generator, Generator]:
        """See :class:`Surface`."""
        frame = self._axes
        return (Generator("translation", components(frame[:, 1])), Generator("translation", components(frame[:, 2])))

    @cached_property
    def _axes(self) -> FloatArray:
        """Columns e1 (into the plane), e2 (down the slope), e3 = e1 × e2."""
        rotation = tilted(self.tilt)
        return read_only(np.stack([-rotation[:, 2], rotation[:, 0], -rotation[:, 1]], axis=-1))

    @cached_property
    def _e1(self) -> tuple[float, float, float]:
        return components(self._axes[:, 0])

    @cached_property
    def _triad(self) -> tuple[float, ...]:
        return tuple(self._axes.T.ravel().tolist())

    def triad(self, *_: float) -> tuple[float, ...]:
        """See :class:`Surface`; the same everywhere."""
        return self._triad

    def moving_triad(self, x: float, y: float, z: float, *_: float) -> tuple[float, ...]:
        """See :class:`Surface`."""
        return self.nearby(x, y, z)[0], *self._triad, 0.0, 0.0, 0.0

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
        shape = np.shape(u)[:-1]
        # numpy takes ten times as long for the frame of one place as for its copy
        return np.broadcast_to(self._axes, (*shape, 3, 3)).copy() if shape else self._axes.copy()

    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.asarray(np.asarray(p_WB, dtype=np.float64) @ self._axes[:, 1:])

    def gap(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.asarray(-np.asarray(p_WB, dtype=np.float64) @ self._axes[:, 0] - self.height)

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        shape = np.shape(p_WB)
        return np.broadcast_to(self._axes[:, 0], shape).copy() if len(shape) > 1 else self._axes[:, 0].copy()

    def normal_gradient(self, p_WB: npt.ArrayLike) -> FloatArray:
        """See :class:`Surface`."""
        return np.zeros((*np.shape(p_WB), 3))
