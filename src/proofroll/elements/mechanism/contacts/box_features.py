"""Two boxes: corners of each on a face of the other, and edges that cross.

The faces that meet are those most turned to the direction in which the boxes are farthest apart, or overlap least, of
all normals of faces and all directions across two edges. A pair has a contact for each corner of both faces and
for each two of their edges; one that lies beyond the border of the other face, or beyond the ends of an edge, is
absent.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from proofroll.elements.mechanism.contacts.shapes import BoxShape, HalfSpace, Shape, SphereShape
from proofroll.elements.mechanism.contacts.walls import EdgeLine
from proofroll.elements.mechanism.rotations import Array, cross

CORNERS = 4  # of a face, and its edges
SLOTS = 2 * CORNERS + CORNERS**2  # contacts of a pair: corners of the first face, of the second, edges that cross
_SIGNS = tuple(itertools.product((-1.0, 1.0), repeat=2))
# Relative to a box: length within a border that counts as inside for a corner, and as outside for edges, where corners
# meet; and overlap of edges, or sine of the angle behind a face, up to which they may touch: far above the errors of
# states within a step.
_ON_BORDER, _BEHIND = 1e-13, 1e-4
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
        along = apart @ ways
        ways = ways * np.where(along < 0, -1.0, 1.0)
        wide = self.half_a @ np.abs(A.T @ ways) + self.half_b @ np.abs(B.T @ ways)
        return ways, np.abs(along) - wide

    def normal(self, first: bool, face: int) -> Array:
        """Outward normal of a face in the world."""
        axes, side = self.axes_a if first else self.axes_b, 1.0 if face % 2 == 0 else -1.0
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
            np.abs(axes.T @ ways).max(axis=0) - sign * self.normal(first, face) @ ways
            for axes, first, face, sign in ((self.axes_a, True, face_a, -1.0), (self.axes_b, False, face_b, 1.0))
        ]
        own = np.maximum(*turned) <= _BEHIND
        if own.all() or not own.any():
            return float(self.half_a.max()) * (-1.0 if own.all() else 1.0)
        return float(apart[~own].max() - apart[own].max())


@dataclass(frozen=True, eq=False)
class BoxSlot:
    """One contact of two boxes; its features are two faces and whether it is absent."""

    first: BoxShape
    second: BoxShape
    slot: int

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
                one, two = divmod(self.slot - 2 * CORNERS, CORNERS)
                self._shapes[faces] = _edge(self.first, faces[0], one), _edge(self.second, faces[1], two)
        return self._shapes[faces]

    def beyond(self, lying: Lying, faces: tuple[int, int]) -> tuple[float, float]:
        """Length by which the contact lies beyond its borders [m], and that which counts as none."""
        size = float(max(lying.half_a.max(), lying.half_b.max()))
        if not self.of_edges:
            first = self.slot < CORNERS
            box, at, axes = (self.first, lying.place_a, lying.axes_a) if first else (
                self.second, lying.place_b, lying.axes_b)  # fmt: skip
            corner = at + axes @ (_corner_signs(faces[0 if first else 1], self.slot % CORNERS) * box.half)
            other, axes, half = (lying.place_b, lying.axes_b, lying.half_b) if first else (
                lying.place_a, lying.axes_a, lying.half_a)  # fmt: skip
            normal = faces[1 if first else 0] // 2
            inside = np.abs(axes.T @ (corner - other)) - half
            return max(value for axis, value in enumerate(inside.tolist()) if axis != normal), size * _ON_BORDER
        return self._of_edges(lying, faces, size), -size * _ON_BORDER

    def _of_edges(self, lying: Lying, faces: tuple[int, int], size: float) -> float:
        numbers = divmod(self.slot - 2 * CORNERS, CORNERS)
        (along_a, signs_a, side_a), (along_b, signs_b, side_b) = map(_edge_signs, faces, numbers)
        u, w = lying.axes_a[:, along_a], lying.axes_b[:, along_b]
        d = lying.place_a + lying.axes_a @ (signs_a * lying.half_a) - lying.place_b
        d = d - lying.axes_b @ (signs_b * lying.half_b)
        across, cosine = cross(u, w), float(u @ w)
        square = float(across @ across)
        if square < _PARALLEL:
            return size
        s = (cosine * float(d @ w) - float(d @ u)) / square
        t = float(d @ w) + s * cosine
        n = across * (np.copysign(1.0, float(across @ lying.normal(False, faces[1]))) / np.sqrt(square))
        behind = [  # a normal between those of the faces at each edge
            -float(n @ lying.normal(False, faces[1])), -float(n @ lying.axes_b @ side_b),
            float(n @ lying.normal(True, faces[0])), float(n @ lying.axes_a @ side_a),
        ]  # fmt: skip
        ends = max(abs(s) - float(lying.half_a[along_a]), abs(t) - float(lying.half_b[along_b]))
        return max(ends, (max(behind) - _BEHIND) * size, -float(n @ d) - _BEHIND * size)


def _in_plane(face: int) -> tuple[int, int]:
    axis = face // 2
    return (axis + 1) % 3, (axis + 2) % 3


def _corner_signs(face: int, number: int) -> Array:
    """Sides of a corner of a face along the axes of its box."""
    signs = np.zeros(3)
    signs[face // 2] = 1.0 if face % 2 == 0 else -1.0
    signs[list(_in_plane(face))] = _SIGNS[number]
    return signs


def _edge_signs(face: int, number: int) -> tuple[int, Array, Array]:
    """Axis along an edge of a face, sides of its middle, and normal of the other face at it, in the axes of its box."""
    along, other = _in_plane(face) if number < 2 else _in_plane(face)[::-1]
    signs, side = np.zeros(3), np.zeros(3)
    signs[face // 2] = 1.0 if face % 2 == 0 else -1.0
    signs[other] = side[other] = 1.0 if number % 2 == 0 else -1.0
    return along, signs, side


def _corner(box: BoxShape, face: int, number: int) -> SphereShape:
    return SphereShape(box.centre + box.frame @ (_corner_signs(face, number) * box.half), 0.0)


def _face(box: BoxShape, face: int) -> HalfSpace:
    normal = (1.0 if face % 2 == 0 else -1.0) * box.frame[:, face // 2]
    return HalfSpace(box.centre + box.half[face // 2] * normal, normal)


def _edge(box: BoxShape, face: int, number: int) -> EdgeLine:
    along, signs, _ = _edge_signs(face, number)
    outward = (1.0 if face % 2 == 0 else -1.0) * box.frame[:, face // 2]
    return EdgeLine(box.centre + box.frame @ (signs * box.half), box.frame[:, along].copy(), 0.0, outward)
