"""Base of curved walls: gap, normal and the normal's gradient are derivatives of one formula of a distance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis
from proofroll.elements.mechanism.scene.shapes.walls.formula import differentiated, variables

_UPPER = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])  # places of a symmetric matrix in its upper half, row by row


class Near(NamedTuple):
    """A wall as seen from a place, in the wall's axes.

    Attributes:
        distance: of the place from the wall [m]; negative within the material.
        normal: unit vector away from the wall, the gradient of the distance.
        bend: gradient of the normal [1/m], (3, 3).
    """

    distance: float
    normal: Array
    bend: Array


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
        """True if :meth:`away` is a formula; if not, :meth:`near` searches the nearest point."""
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

    def near(self, place: Array) -> Near:
        """The wall as seen from a place; without a normal, zero, where several points of it are nearest."""
        parts = _field(self)(*place.tolist())
        values = np.array(parts)
        if not np.isfinite(values).all():
            with np.errstate(invalid="ignore"):
                distance = float(self.away(*place.tolist()))
            return Near(distance, np.zeros(3), np.zeros((3, 3)))
        return Near(float(values[0]), values[1:4], values[4:][_UPPER])

    def near_in_scalars(self, place: Any) -> tuple[Any, list[Any], list[list[Any]]]:
        """Distance, normal and rows of the normal's gradient in any scalars."""
        jet = self.away(*variables(*place))
        return jet.value, jet.first, [[jet.second[k] for k in row] for row in _UPPER]


# With the wall as key, as an attribute of it would have to be pickled with it.
@lru_cache
def _field(wall: CurvedWall) -> Callable[..., Any]:
    return differentiated(wall.away, 3)[0]
