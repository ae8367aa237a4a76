"""Shapes of bodies that may touch, pairs of shapes with a contact law, and the contacts that they give."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from proofroll.core.arrays import read_only
from proofroll.core.errors import InputError, require_known
from proofroll.elements.mechanism import checks, rotations
from proofroll.elements.mechanism.checks import METRES, RADIANS, RATIO, WORLD, ZERO, Vector, Z
from proofroll.elements.mechanism.contacts.shapes import (
    Bore,
    CircleShape,
    EllipsoidShape,
    HalfSpace,
    Shape,
    SphereShape,
)
from proofroll.elements.mechanism.rotations import Array

GeometryKind = Literal["sphere", "ellipsoid", "circle", "plane", "box", "bore"]
# Fields that describe each kind of geometry, besides its position.
_KEYS: Mapping[str, tuple[str, ...]] = {
    "sphere": ("radius",),
    "ellipsoid": ("axes", "orientation"),
    "circle": ("radius", "normal"),
    "plane": ("normal",),
    "box": ("size", "orientation"),
    "bore": ("radius", "axis"),
}
# Largest semi-axis of an ellipsoid over its smallest. The support function squares the ratio, which costs 1e-10 of the
# height at 1e3; and a contact on a flat side is as stiff as that ratio.
_FLATTEST = 1e3
# Room of a sphere in a bore, relative to the bore's radius, that counts as none: digits of a file.
_ROOM = 1e-9
_RULES = (
    "only a plane with a sphere, ellipsoid, circle or box, a bore with a sphere, and two spheres have a rule; "
    "choose one of these pairs"
)


@dataclass(frozen=True)
class Geometry:
    """A shape fixed to a body.

    Attributes:
        name: unique among geometries.
        body: name of the body that carries it, or ``world``.
        kind: a box touches with its eight vertices; a plane pairs with any other kind but a bore, a sphere also with
            a sphere or a bore, an endless cylindrical hole that it moves in.
        position: of its centre, or of any point of a plane or of a bore's axis, in the body's frame [m].
        orientation: roll, pitch, yaw of an ellipsoid's or a box's axes in the body's frame [rad].
        radius: of a sphere, circle or bore; a sphere of radius 0 is a vertex [m].
        axes: semi-axes of an ellipsoid, the largest at most 1000 times the smallest [m].
        normal: of a plane, out of the material, or of a circle's disc, in the body's frame; default: z.
        axis: of a bore, in the body's frame; default: z.
        size: edges of a box [m].
    """

    name: str
    body: str
    kind: GeometryKind
    position: Vector = field(default=ZERO, metadata=METRES)
    orientation: Vector = field(default=ZERO, metadata=RADIANS)
    radius: float | None = field(default=None, metadata=METRES)
    axes: Vector | None = field(default=None, metadata=METRES)
    normal: Vector = field(default=Z, metadata=RATIO)
    axis: Vector = field(default=Z, metadata=RATIO)
    size: Vector | None = field(default=None, metadata=METRES)

    def __post_init__(self) -> None:
        where = f"geometries.{checks.name(self.name, 'geometries')}"
        require_known(f"{where}.kind", self.kind, _KEYS)
        checks.read(self, where, checks.vector, "position", "orientation")
        checks.read(self, where, checks.axis, "normal", "axis")
        usual = {"orientation": ZERO, "normal": Z, "axis": Z}
        for key in ("radius", "axes", "size", *usual):
            value, asked = getattr(self, key), key in _KEYS[self.kind]
            if not asked and value != usual.get(key):
                raise InputError(f"{where}.{key}", value, f"{_a(self.kind)} has none; it has {_key_list(self.kind)}")
            if asked and value is None:
                raise InputError(f"{where}.{key}", "nothing", f"{_a(self.kind)} needs it; add it")
        if self.radius is not None:
            radius = checks.number(f"{where}.radius", self.radius, at_least=0)
            if self.kind != "sphere" and not radius:
                raise InputError(f"{where}.radius", radius, f"a {self.kind} has a radius above 0; a vertex is a sphere")
            checks.assign(self, radius=radius)
        for key in ("axes", "size"):
            if getattr(self, key) is not None:
                found = checks.vector(f"{where}.{key}", getattr(self, key))
                if min(found) <= 0:
                    raise InputError(f"{where}.{key}", found, "each must be above 0")
                checks.assign(self, **{key: found})
        if self.axes is not None and max(self.axes) > _FLATTEST * min(self.axes):
            advice = f"the largest may be at most {_FLATTEST:g} times the smallest; a flat disc is a circle"
            raise InputError(f"{where}.axes", self.axes, advice)

    @cached_property
    def frame(self) -> Array:
        """Axes in the body's frame, as columns; z is the normal of a plane or a circle, and the axis of a bore."""
        if self.kind == "bore":
            return read_only(rotations.frame_of_axis(self.axis))
        if self.kind in {"plane", "circle"}:
            return read_only(rotations.frame_of_axis(self.normal))
        return read_only(rotations.from_rpy(self.orientation))

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """Shapes that touch, in the body's frame: one, or the eight vertices of a box."""
        centre = np.array(self.position)
        if self.kind == "plane":
            return (HalfSpace(centre, np.array(self.normal)),)
        if self.kind == "bore":
            return (Bore(centre, np.array(self.axis), self.radius or 0.0),)
        if self.kind == "box":
            corners = itertools.product((-0.5, 0.5), repeat=3)
            return tuple(SphereShape(centre + self.frame @ (np.array(self.size) * corner), 0.0) for corner in corners)
        if self.kind == "circle":
            return (CircleShape(centre, self.radius or 0.0, np.array(self.normal)),)
        if self.kind == "ellipsoid":
            return (EllipsoidShape(centre, np.array(self.axes), self.frame),)
        return (SphereShape(centre, self.radius or 0.0),)


@dataclass(frozen=True)
class Pair:
    """Two geometries that may touch, and their contact law; geometries without a pair pass through each other.

    Attributes:
        name: unique among pairs.
        geometries: names of the two; reported forces act on the body of the first.
        friction: Coulomb's coefficient, the same for sticking and slipping.
        restitution: normal speed after an impact over that before it, from 0 to 1.
    """

    name: str
    geometries: tuple[str, str]
    friction: float = field(metadata=RATIO)
    restitution: float = field(default=0.0, metadata=RATIO)

    def __post_init__(self) -> None:
        where = f"pairs.{checks.name(self.name, 'pairs')}"
        if len(self.geometries) != 2:
            raise InputError(f"{where}.geometries", self.geometries, "give the names of two")
        checks.assign(self, geometries=tuple(self.geometries))
        checks.read(self, where, checks.number, "friction", "restitution", at_least=0)
        if self.restitution > 1:
            advice = "no impact returns more than it takes; give 0 to 1"
            raise InputError(f"{where}.restitution", self.restitution, advice)


@dataclass(frozen=True)
class BodyContact:
    """A possible contact of two bodies: of a pair, or of one vertex of a box in a pair.

    Attributes:
        name: of the pair; a box adds ``.1`` to ``.8``.
        body_a, body_b: of the first and the second geometry.
        shape_a, shape_b: in the frames of these; one of them may be a wall.
        friction, restitution: of the pair.
        pair: its name.
        bound: largest friction without a normal force; always 0 between bodies [N].
    """

    bound: ClassVar[float] = 0.0
    name: str
    body_a: str
    body_b: str
    shape_a: Shape
    shape_b: Shape
    friction: float
    restitution: float
    pair: str = ""

    @property
    def of_disc(self) -> bool:
        """True if one of the shapes is a circle."""
        return isinstance(self.shape_a, CircleShape) or isinstance(self.shape_b, CircleShape)


def contacts_of(geometries: Sequence[Geometry], pairs: Sequence[Pair]) -> tuple[BodyContact, ...]:
    """Contacts of all pairs, in their order. Raises InputError if a pair cannot touch or is listed twice."""
    known = {geometry.name: geometry for geometry in geometries}
    found: list[BodyContact] = []
    listed: dict[frozenset[str], str] = {}
    for pair in pairs:
        where = f"pairs.{pair.name}.geometries"
        for name in pair.geometries:
            require_known(where, name, known, "there is no such geometry; choose from")
        a, b = (known[name] for name in pair.geometries)
        if a.body == b.body:
            owner = "the world" if a.body == WORLD else f"the body {a.body}"
            raise InputError(where, pair.geometries, f"both belong to {owner}, which cannot touch itself")
        if frozenset(pair.geometries) in listed:
            advice = f"these are the pair {listed[frozenset(pair.geometries)]} already; remove one"
            raise InputError(where, pair.geometries, advice)
        listed[frozenset(pair.geometries)] = pair.name
        kinds = {a.kind, b.kind}
        if kinds in ({"plane"}, {"plane", "bore"}) or not (
            "plane" in kinds or kinds in ({"sphere"}, {"sphere", "bore"})
        ):
            raise InputError(where, pair.geometries, _RULES)
        if "bore" in kinds:
            bore, ball = (a, b) if a.kind == "bore" else (b, a)
            if (ball.radius or 0.0) >= (1 - _ROOM) * (bore.radius or 0.0):
                advice = (
                    f"a sphere of radius {ball.radius:g} m has no room in a bore of {bore.radius:g} m; make it smaller"
                )
                raise InputError(where, pair.geometries, advice)
        if kinds == {"sphere"} and not (a.radius or b.radius):
            raise InputError(where, pair.geometries, "two points have no direction between them; give one a radius")
        touching = list(itertools.product(a.shapes, b.shapes))
        for number, (one, other) in enumerate(touching, 1):
            name = pair.name if len(touching) == 1 else f"{pair.name}.{number}"
            found.append(BodyContact(name, a.body, b.body, one, other, pair.friction, pair.restitution, pair.name))
    return tuple(found)


def shared_pairs(contacts: Sequence[BodyContact]) -> dict[str, list[int]]:
    """Indices of the contacts of each pair that has several, by its name."""
    found: dict[str, list[int]] = {}
    for k, contact in enumerate(contacts):
        found.setdefault(contact.pair, []).append(k)
    return {name: numbers for name, numbers in found.items() if len(numbers) > 1}


def pair_sums(contacts: Sequence[BodyContact]) -> Array:
    """Matrix that sums over the contacts of each pair with several, (such pairs, contacts)."""
    sums = [np.isin(np.arange(len(contacts)), numbers) for numbers in shared_pairs(contacts).values()]
    return np.array(sums, dtype=float).reshape(len(sums), len(contacts))


def _a(kind: str) -> str:
    return f"an {kind}" if kind == "ellipsoid" else f"a {kind}"


def _key_list(kind: str) -> str:
    return " and ".join(_KEYS[kind])
