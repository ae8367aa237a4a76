"""Shapes from the numbers of geometries: distances, normals and gaps in closed form.

Places are in the frame of the body that carries the shape.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from proofroll.truth.check.laws.integrals import cross, dot, norm, of_angles, turned, turned_back
from proofroll.truth.check.laws.record import Array

if TYPE_CHECKING:
    from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
    from proofroll.elements.mechanism.scene.shapes.walls import Declared

# Contacts of two geometries that are neither a plane nor one contact.
_SLOTS = {("box", "box"): 24, ("box", "capsule"): 22}
_FACE = 1e-9  # distance from an edge, relative to the size of a box or cylinder, up to which there is no normal
_SEARCHES = 80  # thirds by which the nearest place of a capsule's axis is enclosed: 0.67^80 is below round-off
_PARALLEL = 1e-12  # sine of an angle between edges below which their perpendicular is round-off


class SurfaceShape(NamedTuple):
    """A shape: kind of geometry, centre or point, axis or normal, radius, half edges or semi-axes, and their frame."""

    kind: str
    centre: Array
    axis: Array
    radius: float
    half: Array
    frame: Array
    ring: float
    slope: float
    surface: Declared | None = None
    metre: float = 1.0

    @property
    def bend(self) -> float:
        """Largest curvature of its smooth parts [1/m]."""
        if self.kind == "ellipsoid":
            return float(self.half.max() / self.half.min() ** 2)
        return 1.0 / self.radius if self.radius else 0.0


class PairContact(NamedTuple):
    """A place where two bodies may touch: the shapes there, the whole solids, and the law of its pair."""

    name: str
    pair: Pair
    a: int
    b: int
    shape_a: SurfaceShape
    shape_b: SurfaceShape
    solid_a: SurfaceShape
    solid_b: SurfaceShape
    alone: bool  # its gap is that of the shapes; False: one of several places where two solids meet


def shape_of(geometry: Geometry) -> SurfaceShape:
    """Whole shape of a geometry."""
    axis = np.array(geometry.normal if geometry.kind in {"plane", "circle"} else geometry.axis)
    half = np.zeros(3)
    if geometry.size is not None:
        half = np.array(geometry.size) / 2
    elif geometry.axes is not None:
        half = np.array(geometry.axes)
    elif geometry.length is not None:
        half = np.full(3, geometry.length / 2)
    return SurfaceShape(
        kind=geometry.kind,
        centre=np.array(geometry.position),
        axis=axis,
        radius=geometry.radius or 0.0,
        half=half,
        frame=of_angles(np.array(geometry.orientation)),
        ring=geometry.ring_radius or 0.0,
        slope=geometry.slope or 0.0,
        surface=getattr(geometry, "surface", None),
        metre=getattr(geometry, "metre", 1.0),
    )


def _on_plane(shape: SurfaceShape) -> list[SurfaceShape]:
    """Parts of a solid that meet a plane: corners of a box, ends of a capsule, rims of a cylinder, else itself."""
    if shape.kind == "box":
        signs = itertools.product((-1.0, 1.0), repeat=3)
        return [
            shape._replace(kind="sphere", centre=shape.centre + shape.frame @ (shape.half * sign)) for sign in signs
        ]
    if shape.kind in {"capsule", "cylinder"}:
        kind = "sphere" if shape.kind == "capsule" else "circle"
        return [shape._replace(kind=kind, centre=shape.centre + side * shape.half * shape.axis) for side in (-1.0, 1.0)]
    return [shape]


def contacts_of(geometries: Sequence[Geometry], pairs: Sequence[Pair], index: dict[str, int]) -> list[PairContact]:
    """Contacts of all pairs, in their order; ``index``: of each body."""
    by_name, contacts = {geometry.name: geometry for geometry in geometries}, list[PairContact]()
    for pair in pairs:
        geometry_a, geometry_b = (by_name[name] for name in pair.geometries)
        a, b = shape_of(geometry_a), shape_of(geometry_b)
        count = _SLOTS.get((min(a.kind, b.kind), max(a.kind, b.kind)), 1)
        shapes = [(a, b)] * count
        if "plane" in {a.kind, b.kind}:
            shapes = list(itertools.product(_on_plane(a), _on_plane(b)))
        for number, (part_a, part_b) in enumerate(shapes, 1):
            name = pair.name if len(shapes) == 1 else f"{pair.name}.{number}"
            contacts.append(
                PairContact(
                    name=name,
                    pair=pair,
                    a=index[geometry_a.body],
                    b=index[geometry_b.body],
                    shape_a=part_a,
                    shape_b=part_b,
                    solid_a=a,
                    solid_b=b,
                    alone=count == 1,
                )
            )
    return contacts


def near(shape: SurfaceShape, x: Array) -> tuple[Array, Array]:  # noqa: PLR0911 -- one rule for each kind of shape
    """Distance of places from a shape [m], negative in its material, and its gradient; NaN where it is not smooth."""
    y, none = x - shape.centre, np.full(x.shape, np.nan)
    if shape.surface is not None:
        return shape.surface.gap(x / shape.metre) * shape.metre, -shape.surface.normal(x / shape.metre)
    if shape.kind == "plane":
        return dot(y, shape.axis), np.broadcast_to(shape.axis, x.shape)
    if shape.kind in {"sphere", "bowl"}:
        away, sign = norm(y), 1.0 if shape.kind == "sphere" else -1.0
        smooth = (away > 0) & (shape.radius > 0)
        return sign * (away - shape.radius), np.divide(sign * y, away[..., None], out=none, where=smooth[..., None])
    if shape.kind == "ellipsoid":  # to first order: exact on the surface, where it is asked
        y = turned_back(shape.frame, y)
        level, slope = norm(y / shape.half), norm(y / shape.half**2)
        return (level - 1) * level / slope, turned(shape.frame, y / shape.half**2 / slope[..., None])
    if shape.kind == "box":
        y = turned_back(shape.frame, y)
        beyond = np.abs(y) - shape.half
        edges = (beyond > -_FACE * shape.half.max()).sum(-1) > 1
        face = np.eye(3)[beyond.argmax(-1)] * np.sign(y)
        distance = norm(np.maximum(beyond, 0)) + np.minimum(beyond.max(-1), 0)
        return distance, np.where(edges[..., None], none, turned(shape.frame, face))
    height = dot(y, shape.axis)
    across = y - height[..., None] * shape.axis
    r = norm(across)
    radial = across / np.maximum(r, np.finfo(float).tiny)[..., None]
    if shape.kind in {"bore", "shaft"}:
        sign = 1.0 if shape.kind == "shaft" else -1.0
        return sign * (r - shape.radius), sign * radial
    if shape.kind == "cone":
        c, s = np.cos(shape.slope), np.sin(shape.slope)
        return height * c - r * s, c * shape.axis - s * radial
    if shape.kind == "torus":
        away = np.hypot(r - shape.ring, height)
        gradient = (r - shape.ring)[..., None] * radial + height[..., None] * shape.axis
        return away - shape.radius, gradient / away[..., None]
    if shape.kind == "circle":  # its rim
        return np.hypot(r - shape.radius, height), none
    half = shape.half[0]
    if shape.kind == "capsule":
        end = y - np.clip(height, -half, half)[..., None] * shape.axis
        away = norm(end)
        return away - shape.radius, end / away[..., None]
    beyond = np.stack([r - shape.radius, np.abs(height) - half], -1)  # cylinder
    rim = (beyond > -_FACE * max(half, shape.radius)).all(-1)
    side = (beyond[..., 0] > beyond[..., 1])[..., None]
    gradient = np.where(side, radial, np.sign(height)[..., None] * shape.axis)
    distance = norm(np.maximum(beyond, 0)) + np.minimum(beyond.max(-1), 0)
    return distance, np.where(rim[..., None], none, gradient)


Pose = tuple[Array, Array]  # origin and rotation of a body


def seen_from(pose: Pose, x: Array) -> Array:
    """Places in the frame of a body."""
    return turned_back(pose[1], x - pose[0])


def gap(a: SurfaceShape, b: SurfaceShape, A: Pose, B: Pose) -> Array:
    """Distance of two shapes at the poses of their bodies [m]; of boxes a lower bound of it, exact where they touch."""
    if a.kind == "plane" or (b.kind == "sphere" and a.kind not in {"plane", "sphere"}):
        a, b, A, B = b, a, B, A
    if b.kind == "plane":
        normal = turned(B[1], b.axis)
        place = A[0] + turned(A[1], lowest(a, turned_back(A[1], normal)))
        return dot(normal, place - B[0] - turned(B[1], b.centre))
    if a.kind == "sphere":
        return near(b, seen_from(B, A[0] + turned(A[1], a.centre)))[0] - a.radius
    if a.kind == b.kind == "box":
        return _apart(a, b, A, B)
    if a.kind != "capsule":
        a, b, A, B = b, a, B, A
    middle, axis = A[0] + turned(A[1], a.centre), turned(A[1], np.asarray(a.half[0] * a.axis))

    def away(part: Array) -> Array:
        return near(b, seen_from(B, middle + part[..., None] * axis))[0]

    low, high = -np.ones(middle.shape[:-1]), np.ones(middle.shape[:-1])
    for _ in range(_SEARCHES):  # the distance from a convex solid is convex along a line
        left, right = (2 * low + high) / 3, (low + 2 * high) / 3
        nearer = away(left) < away(right)
        low, high = np.where(nearer, low, left), np.where(nearer, right, high)
    return np.asarray(np.min([away(part) for part in (low, high, (low + high) / 2)], 0)) - a.radius


def lowest(shape: SurfaceShape, normal: Array) -> Array:
    """Place of a convex shape that lies lowest along directions, in the frame of the body."""
    if shape.kind == "ellipsoid":
        y = turned_back(shape.frame, normal) * shape.half
        return shape.centre - turned(shape.frame, y * shape.half / norm(y)[..., None])
    if shape.kind == "circle":
        across = normal - dot(normal, shape.axis)[..., None] * shape.axis
        return shape.centre - shape.radius * across / np.maximum(norm(across), np.finfo(float).tiny)[..., None]
    return shape.centre - shape.radius * normal


def _apart(a: SurfaceShape, b: SurfaceShape, A: Pose, B: Pose) -> Array:
    """Largest distance of two boxes along normals of faces and of pairs of edges (separating axes)."""
    U, W = A[1] @ a.frame, B[1] @ b.frame
    apart = A[0] + turned(A[1], a.centre) - B[0] - turned(B[1], b.centre)
    faces = np.concatenate([U.swapaxes(-1, -2), W.swapaxes(-1, -2)], -2)
    edges = cross(U.swapaxes(-1, -2)[..., :, None, :], W.swapaxes(-1, -2)[..., None, :, :])
    edges = edges.reshape(*U.shape[:-2], 9, 3)
    size = norm(edges)[..., None]
    directions = np.concatenate([faces, np.where(size > _PARALLEL, edges / np.maximum(size, _PARALLEL), 0.0)], -2)
    reach = np.abs(directions @ U) @ a.half + np.abs(directions @ W) @ b.half
    distance = np.abs(turned(directions, apart)) - reach
    return np.asarray(np.where(norm(directions) > 0.5, distance, -np.inf).max(-1))
