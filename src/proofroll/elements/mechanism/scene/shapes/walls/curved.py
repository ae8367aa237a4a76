"""Base of curved walls: gap, normal and the normal's gradient are derivatives of one formula of a distance."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis, turned, turned_back
from proofroll.elements.mechanism.scene.shapes.walls.formula import RecordedProgram, differentiated, variables

UPPER = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])  # places of a symmetric matrix in its upper half, row by row
NO_NORMAL, NO_BEND = (0.0, 0.0, 0.0), (0.0,) * 6
# A wall as seen from a place, in its own axes: distance [m], negative within the material; unit normal away from it,
# the gradient of the distance; upper half of the normal's gradient, row by row [1/m].
Seen = tuple[float, Sequence[float], Sequence[float]]


@dataclass(frozen=True, eq=False)
class CurvedWall:
    """Wall fixed to a body, by an axis of unit length through a point [m] in the body's frame.

    A subclass defines :meth:`away`.
    """

    point: Array
    axis: Array

    kind: ClassVar[str]

    @property
    def has_formula(self) -> bool:
        """True if :meth:`away` is a formula; if not, :meth:`seen` searches the nearest point."""
        return True

    def away(self, x: Any, y: Any, z: Any) -> Any:
        """Distance of a place from the wall [m], in the wall's axes; z is ``axis``.

        Coordinates are numbers, or anything with arithmetic and the functions of
        :mod:`proofroll.elements.mechanism.scene.shapes.walls.formula`.
        """
        raise NotImplementedError

    @cached_property
    def frame(self) -> Array:
        """The wall's axes in the body's frame, as columns."""
        return frame_of_axis(self.axis)

    @cached_property
    def axes(self) -> Any:
        """Rows of :attr:`frame` in plain floats."""
        return self.frame.tolist()

    def seen(self, x: float, y: float, z: float) -> Seen:
        """The wall as seen from a place, in floats or symbols; its normal is zero where several points are nearest."""
        if not isinstance(x + y + z, float):
            jet = self.away(*variables(x, y, z))
            return jet.value, jet.first, jet.second
        parts = _field(self)(x, y, z)
        if math.isfinite(sum(parts)):
            return parts[0], parts[1:4], parts[4:]
        with np.errstate(invalid="ignore"):
            return float(self.away(x, y, z)), NO_NORMAL, NO_BEND


class PlacedWall:
    """A wall in axes other than those of its body, for places in plain floats."""

    def __init__(self, wall: CurvedWall, R: Array, origin: Array) -> None:
        """Takes the rotation from the frame of the wall's body to the axes, and their origin in that frame [m]."""
        self._wall, self._axes = wall, (R @ wall.frame).tolist()
        self._point, program = (R @ (wall.point - origin)).tolist(), RecordedProgram(3)
        self._formula: Callable[..., tuple[float, ...]] = self._found
        if wall.has_formula:
            jet = wall.away(*self._in_wall(*variables(*program.symbols)))
            (self._formula,) = program.functions([jet.value, *jet.first], math)

    def _in_wall(self, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
        u, v, w = self._point
        return turned_back(self._axes, (x - u, y - v, z - w))

    def seen(self, x: float, y: float, z: float) -> tuple[float, float, float, float]:
        """Distance of a place from the wall [m] and normal; along the axis where several points of it are nearest."""
        try:
            distance, u, v, w = self._formula(x, y, z)
        except (ValueError, ArithmeticError):
            distance, u, v, w = self._found(x, y, z)
        return distance, u, v, w

    def _found(self, x: float, y: float, z: float) -> tuple[float, ...]:
        distance, normal, _ = self._wall.seen(*self._in_wall(x, y, z))
        return distance, *turned(self._axes, normal if any(normal) else (0.0, 0.0, 1.0))


# With the wall as key, as an attribute of it would have to be pickled with it.
@lru_cache
def _field(wall: CurvedWall) -> Callable[..., Any]:
    return differentiated(wall.away, 3)[0]
