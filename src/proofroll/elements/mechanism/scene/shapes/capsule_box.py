"""A capsule and a box: its ends at the nearest feature of the box, its side at edges and corners of the box.

An end is absent where a place between the ends is nearer, and the side where it does not cross an edge or corner.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.features import BallFeatures
from proofroll.elements.mechanism.scene.shapes.shapes import BoxShape, CapsuleShape, Shape, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls import Shaft

ENDS = (-1.0, 1.0)
EDGES = [(axis, one, two) for axis in range(3) for one, two in itertools.product((-1.0, 1.0), repeat=2)]
CORNERS = list(itertools.product((-1.0, 1.0), repeat=3))
SLOTS = len(ENDS) + len(EDGES) + len(CORNERS)
# Relative to the box: length within a border that is round-off. Sine of the angle behind a face up to which a side may
# touch an edge: a capsule that lies on the face is there.
_ON_BORDER, _BEHIND = 1e-13, 1e-4
_PARALLEL = 1e-12  # square of the sine of the angle between a side and an edge that do not cross
_NONE = 13  # number of no feature of a ball


@dataclass(frozen=True, eq=False)
class CapsuleBoxSlot:
    """One contact of a capsule and a box: of an end, of its side and an edge, or of its side and a corner.

    ``capsule_first``: the capsule is the first of the two.
    """

    capsule: CapsuleShape
    box: BoxShape
    slot: int
    capsule_first: bool

    count: ClassVar[int] = SLOTS
    leads: ClassVar[bool] = False
    strikes_sides: ClassVar[bool] = True

    @staticmethod
    def absent(feature: int) -> bool:
        """True if there is no contact with this feature."""
        return bool(feature % 2)

    @property
    def centres(self) -> tuple[Array, Array]:
        """Centres of the first and the second shape [m]."""
        both = self.capsule.centre, self.box.centre
        return both if self.capsule_first else both[::-1]

    @cached_property
    def _ball(self) -> BallFeatures:
        end = self.capsule.centre + ENDS[self.slot] * self.capsule.half * self.capsule.axis
        return BallFeatures(SphereShape(end, self.capsule.radius), self.box, self.capsule_first)

    def shapes(self, feature: int) -> tuple[Shape, Shape]:
        """Simple shapes of the first and the second solid."""
        if self.slot < len(ENDS):
            return self._ball.shapes(feature // 2 - _NONE)
        both = Shaft(self.capsule.centre, self.capsule.axis, self.capsule.radius), self._of_box
        return both if self.capsule_first else both[::-1]

    @cached_property
    def _of_box(self) -> Shape:
        box, number = self.box, self.slot - len(ENDS)
        if number < len(EDGES):
            axis, signs = _edge(number)
            return Shaft(box.centre + box.frame @ (signs * box.half), box.frame[:, axis].copy(), 0.0)
        corner = np.array(CORNERS[number - len(EDGES)])
        return SphereShape(box.centre + box.frame @ (corner * box.half), 0.0)

    def nearest(self, centre: Array, axis: Array) -> int:
        """Features at a place of the capsule's centre, and with its axis, in the axes of the box."""
        absent = self._beyond(centre, axis) > 0
        if self.slot >= len(ENDS):
            return int(absent)
        end = centre + ENDS[self.slot] * self.capsule.half * axis
        return 1 if absent else 2 * (self._ball.nearest(*end.tolist()) + _NONE)

    def left_by(self, feature: int, centre: Array, axis: Array) -> float:
        """Length by which features are left [m]; the same arguments as of :meth:`nearest`."""
        beyond = self._beyond(centre, axis)
        if self.absent(feature):
            return -beyond
        if self.slot >= len(ENDS):
            return beyond
        end = centre + ENDS[self.slot] * self.capsule.half * axis
        borders = self._ball.borders(feature // 2 - _NONE, *end.tolist())
        return max(beyond, *(float(border.left_by) for border in borders))

    def _beyond(self, centre: Array, axis: Array) -> float:
        """Length by which the contact is not there [m]."""
        half, size, number = self.box.half, float(self.box.half.max()), self.slot - len(ENDS)
        least = size * _ON_BORDER
        if number < 0:
            side = ENDS[self.slot]
            end = centre + side * self.capsule.half * axis
            away = end - np.clip(end, -half, half)
            on_face = np.count_nonzero(away) <= 1  # both ends of a capsule that lies on it
            return side * float(away @ axis) - (_BEHIND * float(np.linalg.norm(away)) if on_face else 0.0) - least
        if number < len(EDGES):
            direction, signs = _edge(number)
            d, cosine = centre - signs * half, float(axis[direction])
            square = 1.0 - cosine * cosine
            if square < _PARALLEL:
                return size
            s = (cosine * float(d[direction]) - float(d @ axis)) / square
            t = float(d[direction]) + s * cosine
            away = d + s * axis
            away[direction] -= t
            sides = np.delete(signs * away, direction)
            ends = max(abs(s) - self.capsule.half, abs(t) - float(half[direction])) + least
            return min(max(ends, -float(sides.min()) - _BEHIND * size), size)
        corner = np.array(CORNERS[number - len(EDGES)])
        d = centre - corner * half
        s = -float(d @ axis)
        away = d + s * axis
        return max(abs(s) - self.capsule.half + least, -float((corner * away).min()) + least)


def _edge(number: int) -> tuple[int, Array]:
    """Axis along an edge of a box, and sides of its middle along the axes of the box."""
    axis, sign_1, sign_2 = EDGES[number]
    signs = np.zeros(3)
    signs[[(axis + 1) % 3, (axis + 2) % 3]] = sign_1, sign_2
    return axis, signs
