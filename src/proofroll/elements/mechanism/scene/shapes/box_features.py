"""Two boxes: corners of each on a face of the other, and edges that cross.

The faces that meet are those most turned to the direction in which the boxes are farthest apart, or overlap least, of
all normals of faces and all directions across two edges. A pair has a contact for each corner of both faces and
for each two of their edges; one that lies beyond the border of the other face, or beyond the ends of an edge, is
absent.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache, cached_property
from typing import ClassVar

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.shapes import BoxShape, HalfSpace, Shape, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls import EdgeLine

CORNERS = 4  # of a face, and its edges
SLOTS = 2 * CORNERS + CORNERS**2  # contacts of a pair: corners of the first face, of the second, edges that cross
_SIGNS = tuple(itertools.product((-1.0, 1.0), repeat=2))
# Relative to a box: length within a border that counts as inside for a corner, and as outside for edges, where corners
# meet; and overlap of edges, or sine of the angle behind a face, up to which they may touch: far above the errors of
# states within a step.
_ON_BORDER, _BEHIND = 1e-13, 1e-4
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]  # axes of a vector product
_PARALLEL = 1e-18  # square of the sine of the angle between edges that do not cross


@dataclass(frozen=True, eq=False)
class Lying:
    """Two boxes as they lie in the world: centres, axes as columns, half edges."""

    place_a: Array
    axes_a: Array
    half_a: Array
    place_b: Array
    axes_b: Array
    half_b: Array

    @cached_property
    def separations(self) -> tuple[Array, Array]:
        """Directions from b to a in which the boxes may be apart, (3, n), and distance in each of them [m], (n).

        These are the normals of faces, and directions across an edge of each box.
        """
        A, B, apart = self.axes_a, self.axes_b, self.place_a - self.place_b
        across = np.cross(A[:, :, None], B[:, None, :], axis=0).reshape(3, -1)
        sizes = np.linalg.norm(across, axis=0)
        crossing = sizes > _BEHIND
        ways = np.concatenate([A, B, across[:, crossing] / sizes[crossing]], axis=1)
        distances = apart @ ways
        ways = ways * np.where(distances < 0, -1.0, 1.0)
        wide = self.half_a @ np.abs(A.T @ ways) + self.half_b @ np.abs(B.T @ ways)
        return ways, np.abs(distances) - wide

    def normal(self, of_first: bool, face: int) -> Array:
        """Outward normal of a face in the world."""
        axes, side = self.axes_a if of_first else self.axes_b, 1.0 if face % 2 == 0 else -1.0
        return np.asarray(side * axes[:, face // 2])

    @cached_property
    def faces(self) -> tuple[int, int]:
        """Faces of a and of b that meet."""
        ways, apart = self.separations
        way = ways[:, int(np.argmax(apart))]
        of_a, of_b = self.axes_a.T @ way, self.axes_b.T @ way
        a, b = int(np.argmax(np.abs(of_a))), int(np.argmax(np.abs(of_b)))
        return 2 * a + int(of_a[a] > 0), 2 * b + int(of_b[b] < 0)

    def turned_away(self, face_a: int, face_b: int) -> float:
        """Length by which the boxes are farther apart in a direction to which other faces are turned [m]."""
        ways, apart = self.separations
        turned = [
            np.abs(axes.T @ ways).max(axis=0) - sign * self.normal(of_first, face) @ ways
            for axes, of_first, face, sign in ((self.axes_a, True, face_a, -1.0), (self.axes_b, False, face_b, 1.0))
        ]
        hidden = np.maximum(*turned) <= _BEHIND
        if hidden.all() or not hidden.any():
            return float(self.half_a.max()) * (-1.0 if hidden.all() else 1.0)
        return float(apart[~hidden].max() - apart[hidden].max())

    def beyond(self, faces: tuple[int, int]) -> tuple[Array, Array]:
        """Lengths by which all contacts lie beyond their borders [m], (SLOTS), and heights of corners, (2 CORNERS)."""
        if faces not in self._beyond:
            self._beyond[faces] = self._all_beyond(*faces)
        return self._beyond[faces]

    @cached_property
    def _beyond(self) -> dict[tuple[int, int], tuple[Array, Array]]:
        return {}

    def _all_beyond(self, face_a: int, face_b: int) -> tuple[Array, Array]:
        size = float(max(self.half_a.max(), self.half_b.max()))
        to_b = self._seen(self.place_b, self.axes_b, self.place_a, self.axes_a, face_a, self.half_a)
        to_a = self._seen(self.place_a, self.axes_a, self.place_b, self.axes_b, face_b, self.half_b)
        inside, heights = [], []
        for places, half, face in ((to_b, self.half_b, face_b), (to_a, self.half_a, face_a)):
            over = np.abs(places) - half
            over[:, face // 2] = -np.inf
            inside.append(over.max(axis=1))
            heights.append(places[:, face // 2] * (1.0 if face % 2 == 0 else -1.0) - half[face // 2])
        corners = np.concatenate(inside) - size * _ON_BORDER
        edges = self._of_edges(face_a, face_b, size).ravel() + size * _ON_BORDER
        return np.concatenate([corners, edges]), np.concatenate(heights)

    @staticmethod
    def _seen(place: Array, axes: Array, other_place: Array, other_axes: Array, face: int, half: Array) -> Array:
        """Corners of a face of another box in the axes of one, (CORNERS, 3)."""
        return np.asarray((other_place + (_corners_of(face) * half) @ other_axes.T - place) @ axes)

    def _of_edges(self, face_a: int, face_b: int, size: float) -> Array:
        (along_a, signs_a, sides_a), (along_b, signs_b, sides_b) = _edges_of(face_a), _edges_of(face_b)
        u, w = self.axes_a.T[along_a], self.axes_b.T[along_b]
        d = (self.place_a + (signs_a * self.half_a) @ self.axes_a.T)[:, None]
        d = d - (self.place_b + (signs_b * self.half_b) @ self.axes_b.T)[None]
        x, y = u[:, None], w[None]
        across = x[..., _NEXT] * y[..., _LAST] - x[..., _LAST] * y[..., _NEXT]
        square, cosine = np.sum(across**2, axis=-1), u @ w.T
        parallel = square < _PARALLEL
        square = np.where(parallel, 1.0, square)
        of_u, of_w = np.sum(d * x, axis=-1), np.sum(d * y, axis=-1)
        s = (cosine * of_w - of_u) / square
        t = of_w + s * cosine
        normal_a, normal_b = self.normal(True, face_a), self.normal(False, face_b)
        n = across * (np.copysign(1.0, across @ normal_b) / np.sqrt(square))[..., None]
        behind = [  # a normal between those of the faces at each edge
            -(n @ normal_b), -np.sum(n * (sides_b @ self.axes_b.T), axis=-1),
            n @ normal_a, np.sum(n * (sides_a @ self.axes_a.T)[:, None], axis=-1),
        ]  # fmt: skip
        ends = np.maximum(np.abs(s) - self.half_a[along_a][:, None], np.abs(t) - self.half_b[along_b])
        beyond = np.maximum(ends, (np.maximum.reduce(behind) - _BEHIND) * size)
        beyond = np.maximum(beyond, -np.sum(n * d, axis=-1) - _BEHIND * size)
        return np.asarray(np.where(parallel, size, np.minimum(beyond, size)))


@dataclass(frozen=True, eq=False)
class BoxSlot:
    """One contact of two boxes; its features are two faces and whether it is absent."""

    first: BoxShape
    second: BoxShape
    slot: int

    count: ClassVar[int] = SLOTS

    @property
    def strikes_sides(self) -> bool:
        """False for a corner that comes on a face from beside it, below its border: it strikes a side there."""
        return self.of_edges

    @property
    def leads(self) -> bool:
        """True for the contact of a pair that watches which faces meet."""
        return self.slot == 0

    @property
    def of_edges(self) -> bool:
        """True for two edges that cross; else it is a corner of one box on a face of the other."""
        return self.slot >= 2 * CORNERS

    @staticmethod
    def feature(faces: tuple[int, int], absent: bool) -> int:
        """Number of features: of two faces, and whether the contact is absent."""
        return 2 * (6 * faces[0] + faces[1]) + int(absent)

    @staticmethod
    def faces(feature: int) -> tuple[int, int]:
        """Faces of features."""
        return feature // 12, feature // 2 % 6

    @staticmethod
    def absent(feature: int) -> bool:
        """True if there is no contact with these features."""
        return bool(feature % 2)

    @cached_property
    def _shapes(self) -> dict[tuple[int, int], tuple[Shape, Shape]]:
        return {}

    def shapes(self, feature: int) -> tuple[Shape, Shape]:
        """Simple shapes of the first and the second box."""
        faces = self.faces(feature)
        if faces not in self._shapes:
            a, b = self.slot, self.slot - CORNERS
            if self.slot < CORNERS:
                self._shapes[faces] = _corner(self.first, faces[0], a), _face(self.second, faces[1])
            elif self.slot < 2 * CORNERS:
                self._shapes[faces] = _face(self.first, faces[0]), _corner(self.second, faces[1], b)
            else:
                edge_a, edge_b = divmod(self.slot - 2 * CORNERS, CORNERS)
                self._shapes[faces] = _edge(self.first, faces[0], edge_a), _edge(self.second, faces[1], edge_b)
        return self._shapes[faces]


def _in_plane(face: int) -> tuple[int, int]:
    axis = face // 2
    return (axis + 1) % 3, (axis + 2) % 3


@cache
def _corners_of(face: int) -> Array:
    """Sides of the corners of a face along the axes of its box, (CORNERS, 3)."""
    signs = np.zeros((CORNERS, 3))
    signs[:, face // 2] = 1.0 if face % 2 == 0 else -1.0
    signs[:, list(_in_plane(face))] = _SIGNS
    return signs


@cache
def _edges_of(face: int) -> tuple[list[int], Array, Array]:
    """Axes along the edges of a face, sides of their middles, normals of the other faces there, in the box's axes."""
    directions, signs, sides = [], np.zeros((CORNERS, 3)), np.zeros((CORNERS, 3))
    signs[:, face // 2] = 1.0 if face % 2 == 0 else -1.0
    for number in range(CORNERS):
        axis, across = _in_plane(face) if number < 2 else _in_plane(face)[::-1]
        directions.append(axis)
        signs[number, across] = sides[number, across] = 1.0 if number % 2 == 0 else -1.0
    return directions, signs, sides


def _corner(box: BoxShape, face: int, number: int) -> SphereShape:
    return SphereShape(box.centre + box.frame @ (_corners_of(face)[number] * box.half), 0.0)


def _face(box: BoxShape, face: int) -> HalfSpace:
    normal = (1.0 if face % 2 == 0 else -1.0) * box.frame[:, face // 2]
    return HalfSpace(box.centre + box.half[face // 2] * normal, normal)


def _edge(box: BoxShape, face: int, number: int) -> EdgeLine:
    directions, signs, _ = _edges_of(face)
    outward = (1.0 if face % 2 == 0 else -1.0) * box.frame[:, face // 2]
    middle = box.centre + box.frame @ (signs[number] * box.half)
    return EdgeLine(middle, box.frame[:, directions[number]].copy(), 0.0, outward)
