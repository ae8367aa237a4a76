"""Features of solids -- faces, edges, corners, sides, ends -- and which of them are nearest.

Two features touch by the rule of a simple shape: a face as a plane, an edge as a shaft without a radius, a corner as a
vertex, a rim as a ring of such a wire. Which features are nearest follows from three measures of how the shapes lie;
the borders between features are zeros of formulas of these. Where the nearest features change, gap and normal go on,
and the rate of the normal jumps.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis
from proofroll.elements.mechanism.scene.shapes.shapes import (
    BoxShape,
    CapsuleShape,
    CylinderShape,
    HalfSpace,
    Shape,
    Solid,
    SphereShape,
)
from proofroll.elements.mechanism.scene.shapes.walls import Shaft, TorusWall

_SIDES = (-1, 0, 1)


class Border(NamedTuple):
    """Border of features.

    Attributes:
        left_by: length by which the features are no longer the nearest [m], in any scalars; below zero while they are.
        beyond: number of the features behind the border.
    """

    left_by: Any
    beyond: int


class PairFeatures(Protocol):
    """Features of a pair of solids."""

    def nearest(self, x: float, y: float, z: float) -> int:
        """Number of the nearest features at these measures."""

    def shapes(self, feature: int) -> tuple[Shape, Shape]:
        """Simple shapes of the features of the first and the second solid."""

    def borders(self, feature: int, x: Any, y: Any, z: Any) -> list[Border]:
        """Borders of features at these measures, in any scalars."""

    def needs_angle(self, feature: int) -> bool:
        """True if the features are nearest at one point only as long as the axes of the solids are not parallel."""


@dataclass(frozen=True, eq=False)
class BallFeatures:
    """Features of a solid, which a ball meets; the measures are the place of the ball's centre in the solid's axes [m].

    ``ball_first``: the ball is the first of the two.
    """

    ball: SphereShape
    solid: Solid
    ball_first: bool

    @property
    def centres(self) -> tuple[Array, Array]:
        """Centres of the first and the second shape, each in its body's frame [m]."""
        both = self.ball.centre, self.solid.centre
        return both if self.ball_first else both[::-1]

    @cached_property
    def axes(self) -> Array:
        """Axes of the solid in its body's frame, as columns; z is the axis of a long one."""
        return self.solid.frame if isinstance(self.solid, BoxShape) else frame_of_axis(self.solid.axis)

    def needs_angle(self, feature: int) -> bool:  # noqa: ARG002 -- a ball has no axis
        """See :class:`PairFeatures`."""
        return False

    def shapes(self, feature: int) -> tuple[Shape, Shape]:
        """See :class:`PairFeatures`."""
        part = self._shapes[feature]
        return (self.ball, part) if self.ball_first else (part, self.ball)

    @cached_property
    def _shapes(self) -> dict[int, Shape]:
        solid = self.solid
        if isinstance(solid, BoxShape):
            return {
                _number(sides): _of_box(solid, np.array(sides)) for sides in itertools.product(_SIDES, repeat=3)
                if any(sides)
            }  # fmt: skip
        parts: dict[int, Shape] = {0: Shaft(solid.centre, solid.axis, solid.radius)}
        for side in (-1, 1):
            end = solid.centre + side * solid.half * solid.axis
            if isinstance(solid, CapsuleShape):
                parts[side] = SphereShape(end, solid.radius)
            else:
                parts[side] = HalfSpace(end, side * solid.axis)
                parts[2 * side] = TorusWall(end, solid.axis, solid.radius, 0.0)
        return parts

    def nearest(self, x: float, y: float, z: float) -> int:
        """See :class:`PairFeatures`; of a centre within the solid, the face that is nearest."""
        solid = self.solid
        if isinstance(solid, BoxShape):
            place = np.array([x, y, z])
            sides = np.where(np.abs(place) > solid.half, np.where(place < 0, -1, 1), 0)
            if not sides.any():
                axis = int(np.argmax(np.abs(place) - solid.half))
                sides[axis] = -1 if place[axis] < 0 else 1
            return _number(sides)
        side = -1 if z < 0 else 1
        beyond, around = abs(z) - solid.half, float(np.hypot(x, y)) - solid.radius
        if isinstance(solid, CapsuleShape):
            return side if beyond > 0 else 0
        if beyond > 0:
            return 2 * side if around > 0 else side
        return 0 if around >= beyond else side

    def borders(self, feature: int, x: Any, y: Any, z: Any) -> list[Border]:
        """See :class:`PairFeatures`; a face is not left through itself."""
        solid, borders = self.solid, list[Border]()
        if isinstance(solid, BoxShape):
            sides = _sides(feature)
            alone = sum(side != 0 for side in sides) == 1
            for side, coordinate, half, step in zip(sides, (x, y, z), solid.half.tolist(), (9, 3, 1), strict=True):
                if not side:
                    borders += [Border(coordinate - half, feature + step), Border(-half - coordinate, feature - step)]
                elif not alone:
                    borders.append(Border(half - side * coordinate, feature - side * step))
            return borders
        if not feature:
            ends = (1, -1)
            return [Border(end * z - solid.half, end) for end in ends]
        side = 1 if feature > 0 else -1
        if isinstance(solid, CapsuleShape):
            return [Border(solid.half - side * z, 0)]
        outwards = (x * x + y * y - solid.radius**2) / (2 * solid.radius)
        if abs(feature) == 1:
            return [Border(outwards, 2 * side)]
        return [Border(-1.0 * outwards, side), Border(solid.half - side * z, 0)]


@dataclass(frozen=True, eq=False)
class CapsuleFeatures:
    """Sides and ends of two capsules.

    The measures are the first centre from the second along both axes [m], and the cosine between the axes.
    """

    first: CapsuleShape
    second: CapsuleShape

    @property
    def centres(self) -> tuple[Array, Array]:
        """Centres of the first and the second capsule, each in its body's frame [m]."""
        return self.first.centre, self.second.centre

    def needs_angle(self, feature: int) -> bool:
        """See :class:`PairFeatures`; two ends need none."""
        return not all(_sides(feature)[1:])

    def shapes(self, feature: int) -> tuple[Shape, Shape]:
        """See :class:`PairFeatures`."""
        return self._shapes[feature]

    @cached_property
    def _shapes(self) -> dict[int, tuple[Shape, Shape]]:
        def part(capsule: CapsuleShape, side: int) -> Shape:
            if side:
                return SphereShape(capsule.centre + side * capsule.half * capsule.axis, capsule.radius)
            return Shaft(capsule.centre, capsule.axis, capsule.radius)

        return {
            _number((0, side_a, side_b)): (part(self.first, side_a), part(self.second, side_b))
            for side_a, side_b in itertools.product(_SIDES, repeat=2)
        }

    def nearest(self, x: float, y: float, z: float) -> int:
        """See :class:`PairFeatures`: nearest points of two segments, each clamped to its segment."""
        a, b, sine = self.first.half, self.second.half, 1 - z * z
        s = min(max((z * y - x) / sine, -a), a) if sine > 0 else a
        t = y + s * z
        if abs(t) > b:
            t = b if t > 0 else -b
            s = min(max(t * z - x, -a), a)
        side_a = 0 if abs(s) < a else (-1 if s < 0 else 1)
        side_b = 0 if abs(t) < b else (-1 if t < 0 else 1)
        return _number((0, side_a, side_b))

    def borders(self, feature: int, x: Any, y: Any, z: Any) -> list[Border]:
        """See :class:`PairFeatures`: a nearest point reaches the end of its segment, or leaves it."""
        (_, side_a, side_b), a, b = _sides(feature), self.first.half, self.second.half
        s, t, sine = side_a * a, side_b * b, 1.0 - z * z
        if not (side_a or side_b):
            s, t = z * y - x, y - z * x  # times the square of the sine, as what follows
            a, b = a * sine, b * sine
        elif not side_b:
            t = y + s * z
        elif not side_a:
            s = t * z - x
        inwards = [Border(side_a * (x + s - t * z), feature - 3 * side_a)] if side_a else []
        inwards += [Border(side_b * (t - y - s * z), feature - side_b)] if side_b else []
        outwards = [] if side_a else [Border(s - a, feature + 3), Border(-1.0 * s - a, feature - 3)]
        outwards += [] if side_b else [Border(t - b, feature + 1), Border(-1.0 * t - b, feature - 1)]
        return inwards + outwards


SolidFeatures = BallFeatures | CapsuleFeatures


def features_between(shape_a: Shape | Solid, shape_b: Shape | Solid) -> SolidFeatures | None:
    """Features by which two shapes meet; None: they have one rule, or none."""
    solids = BoxShape | CapsuleShape | CylinderShape
    if isinstance(shape_a, CapsuleShape) and isinstance(shape_b, CapsuleShape):
        return CapsuleFeatures(shape_a, shape_b)
    if isinstance(shape_a, SphereShape) and isinstance(shape_b, solids):
        return BallFeatures(shape_a, shape_b, ball_first=True)
    if isinstance(shape_a, solids) and isinstance(shape_b, SphereShape):
        return BallFeatures(shape_b, shape_a, ball_first=False)
    return None


def _number(sides: Any) -> int:
    """Number of three sides, each -1, 0 or 1; 0 of the last."""
    x, y, z = (int(side) for side in sides)
    return 9 * x + 3 * y + z


def _sides(number: int) -> tuple[int, int, int]:
    """The sides of a number."""
    z = (number + 1) % 3 - 1
    y = ((number - z) // 3 + 1) % 3 - 1
    return (number - z - 3 * y) // 9, y, z


def _of_box(box: BoxShape, sides: Array) -> Shape:
    """Face, edge or corner of a box on these sides of its axes."""
    place = box.centre + box.frame @ (sides * box.half)
    beyond = np.flatnonzero(sides)
    if len(beyond) == 1:
        return HalfSpace(place, box.frame @ sides)
    if len(beyond) == 2:
        return Shaft(place, box.frame[:, int(np.flatnonzero(sides == 0)[0])].copy(), 0.0)
    return SphereShape(place, 0.0)
