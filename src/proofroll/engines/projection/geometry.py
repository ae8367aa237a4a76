"""The surface as seen along the local axes e1, e2, e3: what the projection method needs to know of geometry.

The frame F has the columns e1 (normal, towards the wall), e2 (along the first coordinate) and e3 = e1 × e2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.surfaces import Generator, Surface


class Local(NamedTuple):
    """Geometry at one point of the surface, all but the frame itself in components along e1, e2, e3.

    Attributes:
        frame: F, columns e1, e2, e3 in the world, shape (3, 3).
        tangents: Fᵀ ∂p/∂u [m/unit], shape (3, 2); the first row is zero.
        second: Fᵀ ∂²p/∂u∂u [m/unit²], shape (3, 2, 2).
        turning: Fᵀ ∂F/∂u [1/unit], shape (3, 3, 2); times u̇ it is the skew matrix of the frame's angular velocity.
    """

    frame: FloatArray
    tangents: FloatArray
    second: FloatArray
    turning: FloatArray


class Geometry(Protocol):
    """Gives the local geometry anywhere on a surface."""

    def at(self, u: FloatArray) -> Local:
        """Local geometry at the coordinates ``u``, shape (2,)."""


def local_geometry(surface: Surface, u: FloatArray) -> Local:
    """Local geometry of any surface from its tangents and second derivatives.

    Only the frame is taken from the surface as it is; how the frame turns follows from its definition: e2 goes along
    the first tangent, and ∂e1 · t = -e1 · ∂t for every tangent t, because e1 · t stays zero.
    """
    frame = surface.frame(u)
    tangents = frame.T @ surface.tangents(u)
    second = np.tensordot(frame.T, surface.second(u), axes=1)
    turning = np.zeros((3, 3, 2))
    turning[1:, 0] = -np.linalg.solve(tangents[1:].T, second[0])  # e2, e3 components of ∂e1
    turning[2, 1] = second[2, 0] / tangents[1, 0]  # e3 component of ∂e2; its e1 component follows by skewness
    return Local(frame, tangents, second, turning - turning.swapaxes(0, 1))


@dataclass(frozen=True)
class GeneralSurface:
    """Any surface, evaluated anew at each point."""

    surface: Surface

    def at(self, u: FloatArray) -> Local:
        """See :class:`Geometry`."""
        return local_geometry(self.surface, u)


class Uniform:
    """A surface that two commuting rigid motions slide along itself: it looks the same from every point of it.

    Then everything along the local axes is constant, and the frame at u is the one at u = 0 turned by the motions.
    """

    @property
    def column(self) -> int | None:
        """Which coordinate turns the frame, if one does."""
        return self._column

    @property
    def axis(self) -> tuple[float, float, float] | None:
        """Unit direction about which the frame turns; None if it does not."""
        return None if self._column is None else self._generators[self._column].axis

    @property
    def parts(self) -> list[FloatArray]:
        """F0, F1, F2 of the frame F0 + sin α F1 + (1 - cos α) F2 at the coordinate α; F0 alone if none turns it."""
        if self._column is None:
            return [self._start.frame]
        return [self._start.frame, self._once, self._twice]

    def __init__(self, surface: Surface, generators: tuple[Generator, Generator]) -> None:
        self._start, self._generators = local_geometry(surface, np.zeros(2)), generators
        # Only one of two commuting motions of a surface turns: a rotation by angle α about the unit axis k takes F
        # to F + sin α [k]F + (1 - cos α) [k]²F (Rodrigues).
        self._column = next((i for i, motion in enumerate(generators) if motion.kind == "rotation"), None)
        if self._column is not None:
            k1, k2, k3 = generators[self._column].axis
            cross = np.array([[0.0, -k3, k2], [k3, 0.0, -k1], [-k2, k1, 0.0]])
            self._once, self._twice = cross @ self._start.frame, cross @ cross @ self._start.frame

    def at(self, u: FloatArray) -> Local:
        """See :class:`Geometry`."""
        if self._column is None:
            return self._start
        angle = u[self._column]
        frame = self._start.frame + np.sin(angle) * self._once + (1.0 - np.cos(angle)) * self._twice
        return Local(frame, *self._start[1:])


def geometry_of(surface: Surface) -> Geometry:
    """The cheapest description that is exact for this surface."""
    generators = surface.generators
    if generators is None:
        return GeneralSurface(surface)
    first, second = generators
    rotations = (first.kind, second.kind).count("rotation")
    parallel = not np.any(np.abs(np.cross(first.axis, second.axis)) > 4 * np.finfo(float).eps)
    commute = rotations == 0 or (rotations == 1 and parallel)
    return Uniform(surface, generators) if commute else GeneralSurface(surface)
