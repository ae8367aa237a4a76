"""Protocol of surfaces on which the centre of a ball moves; only the modules of this folder know particular surfaces.

Each surface gives two independent descriptions of itself: a parametrisation (position, tangents, second
derivatives; what constraint models need) and a signed distance with its derivatives (what contact models need).

Local frame at a point, columns of :meth:`frame`:

* ``e1`` unit normal, from the ball's centre towards the wall,
* ``e2`` along the first coordinate, ``e3 = e1 × e2``.

Array arguments may carry leading dimensions (``...``), e.g. time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, read_only


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
    def kind(self) -> str:
        """Name of the surface in scene files."""

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
        """Largest distance travelled per unit of each coordinate [m/unit]."""

    @property
    def generators(self) -> tuple[Generator, Generator]:
        """Motions G1, G2 with p(u) = G1(u1) G2(u2) p(0), likewise frame(u)."""

    def offset(self, ball_radius: float) -> Surface:
        """Surface on which the centre of a touching ball of this radius [m] moves."""

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
        """Gap [m] and the components of e1 at one point, as floats for loops that call it at every step."""

    def triad(self, x: float, y: float, z: float, /) -> tuple[float, ...]:
        """Components of e1, e2, e3 at one point, nine floats in this order, for loops that call it at every step."""

    def moving_triad(self, x: float, y: float, z: float, vx: float, vy: float, vz: float, /) -> tuple[float, ...]:
        """Gap [m], :meth:`triad` and (∂e1/∂p) v [1/s] for a velocity v [m/s]: 13 floats in this order."""


@lru_cache
def tilted(angle: float) -> FloatArray:
    """Rotation by ``angle`` [rad] about the world's y axis, read-only, shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    return read_only(np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]))  # every caller shares it


def components(column: FloatArray) -> tuple[float, float, float]:
    """A vector of shape (3,) as plain floats."""
    return (float(column[0]), float(column[1]), float(column[2]))
