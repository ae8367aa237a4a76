"""The surface as seen along the local axes e1, e2, e3: what the projection method needs to know of geometry.

The frame F has the columns e1 (normal, towards the wall), e2 (along the first coordinate) and e3 = e1 × e2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

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


@dataclass(frozen=True)
class GeneralSurface:
    """Any surface, evaluated anew at each point, from its tangents and second derivatives.

    Only the frame is taken from the surface as it is; how the frame turns follows from its definition: e2 goes along
    the first tangent, and ∂e1 · t = -e1 · ∂t for every tangent t, because e1 · t stays zero.
    """

    surface: Surface

    def at(self, u: FloatArray) -> Local:
        """Local geometry at the coordinates ``u``, shape (2,)."""
        frame = self.surface.frame(u)
        tangents = frame.T @ self.surface.tangents(u)
        second = np.tensordot(frame.T, self.surface.second(u), axes=1)
        turning = np.zeros((3, 3, 2))
        turning[1:, 0] = -np.linalg.solve(tangents[1:].T, second[0])  # e2, e3 components of ∂e1
        turning[2, 1] = second[2, 0] / tangents[1, 0]  # e3 component of ∂e2; its e1 component follows by skewness
        return Local(frame, tangents, second, turning - turning.swapaxes(0, 1))


class Uniform:
    """A surface that two commuting rigid motions slide along itself: it looks the same from every point of it.

    Then everything along the local axes is constant, and the frame at u is the one at u = 0 turned by the motions.

    Attributes:
        column: which coordinate turns the frame; None if none does.
        axis: unit direction about which the frame turns; zero if it does not.
        parts: F0, F1, F2 of the frame F0 + sin α F1 + (1 - cos α) F2 at the coordinate α (Rodrigues).
    """

    def __init__(self, surface: Surface, generators: tuple[Generator, Generator]) -> None:
        self._start = GeneralSurface(surface).at(np.zeros(2))
        # Only one of two commuting motions of a surface turns.
        self.column = next((i for i, motion in enumerate(generators) if motion.kind == "rotation"), None)
        self.axis = (0.0, 0.0, 0.0) if self.column is None else generators[self.column].axis
        k1, k2, k3 = self.axis
        cross = np.array([[0.0, -k3, k2], [k3, 0.0, -k1], [-k2, k1, 0.0]])
        self.parts = self._start.frame, cross @ self._start.frame, cross @ cross @ self._start.frame

    def at(self, u: FloatArray) -> Local:
        """See :meth:`GeneralSurface.at`."""
        if self.column is None:
            return self._start
        angle, (start, once, twice) = u[self.column], self.parts
        return Local(start + np.sin(angle) * once + (1.0 - np.cos(angle)) * twice, *self._start[1:])


Geometry = GeneralSurface | Uniform


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
