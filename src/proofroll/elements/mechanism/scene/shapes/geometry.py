"""Shapes of bodies that may touch, pairs of shapes with a contact law, and the contacts that they give."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Literal, cast, get_args

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import cross, read_only
from proofroll.core.errors import InputError, require_known
from proofroll.elements.mechanism.scene import checks, rotations
from proofroll.elements.mechanism.scene.checks import METRES, RADIANS, RATIO, WORLD, ZERO, Against, Cone, Vector, Z
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.box_features import BoxSlot
from proofroll.elements.mechanism.scene.shapes.capsule_box import CapsuleBoxSlot
from proofroll.elements.mechanism.scene.shapes.features import SolidFeatures, features_between
from proofroll.elements.mechanism.scene.shapes.pair_rules import CURVED, check_shared, require_rule
from proofroll.elements.mechanism.scene.shapes.shapes import (
    BoxShape,
    CapsuleShape,
    CircleShape,
    CylinderShape,
    EllipsoidShape,
    HalfSpace,
    Shape,
    SphereShape,
)
from proofroll.elements.mechanism.scene.shapes.walls import (
    Bore,
    BowlWall,
    ConeWall,
    CurvedWall,
    Declared,
    DeclaredWall,
    Shaft,
    TorusWall,
)

GeometryKind = Literal[
    "sphere", "ellipsoid", "circle", "plane", "box", "capsule", "cylinder", "bore", "shaft", "bowl", "cone", "torus"
]
# Fields that describe each kind of geometry, besides its position.
_KEYS: Mapping[str, tuple[str, ...]] = {
    "sphere": ("radius",),
    "ellipsoid": ("axes", "orientation"),
    "circle": ("radius", "normal"),
    "plane": ("normal",),
    "box": ("size", "orientation"),
    "capsule": ("radius", "length", "axis"),
    "cylinder": ("radius", "length", "axis"),
    "bore": ("radius", "axis"),
    "shaft": ("radius", "axis"),
    "bowl": ("radius",),
    "cone": ("slope", "axis"),
    "torus": ("ring_radius", "radius", "axis"),
}
# Largest semi-axis of an ellipsoid over its smallest. The support function squares the ratio, which costs 1e-10 of the
# height at 1e3; and a contact on a flat side is as stiff as that ratio.
_FLATTEST = 1e3


@dataclass(frozen=True)
class Geometry:
    """A shape fixed to a body.

    Attributes:
        name: unique among geometries.
        body: name of the body that carries it, or ``world``.
        kind: on a plane a box touches with its eight vertices, a ``capsule`` with the spheres and a ``cylinder`` with
            the rims at its two ends; a plane pairs with these, a sphere, ellipsoid or circle. A sphere also pairs with
            a sphere, box, capsule or cylinder, which it meets at the nearest face, edge, corner, side or end, as two
            capsules meet each other; two boxes meet with corners of faces and edges that cross, a
            capsule and a box with ends, and with its side at edges and corners. A
            sphere also pairs with a curved wall: ``bore``, an endless cylindrical hole; ``shaft``, an
            endless cylinder; ``bowl``, the inside of a sphere; ``cone``, its inside; ``torus``, the outside of a ring
            of round wire.
        position: of its centre, of a cone's tip, or of any point of a plane or of the axis of a bore or shaft, in the
            body's frame [m].
        orientation: roll, pitch, yaw of an ellipsoid's or a box's axes in the body's frame [rad].
        radius: of a sphere, circle, capsule, cylinder, bore, shaft, bowl or a torus's wire; a sphere of radius 0
            is a vertex [m].
        axes: semi-axes of an ellipsoid, the largest at most 1000 times the smallest [m].
        normal: of a plane, out of the material, or of a circle's disc, in the body's frame; default: z.
        axis: of a capsule, cylinder, bore, shaft, cone or torus, in the body's frame; a cone opens along it;
            default: z.
        size: edges of a box [m].
        slope: of a cone's wall from the plane across its axis, above 0 and below a right angle [rad].
        length: of a capsule between the centres of its ends, of a cylinder between its ends [m].
        ring_radius: of a torus, from its axis to the middle of its wire [m].
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
    slope: float | None = field(default=None, metadata=RADIANS)
    ring_radius: float | None = field(default=None, metadata=METRES)
    length: float | None = field(default=None, metadata=METRES)

    def __post_init__(self) -> None:
        where = f"geometries.{checks.name(self.name, 'geometries')}"
        require_known(f"{where}.kind", self.kind, _KEYS)
        checks.read(self, where, checks.vector, "position", "orientation")
        checks.read(self, where, checks.axis, "normal", "axis")
        usual = {"orientation": ZERO, "normal": Z, "axis": Z}
        for key in ("radius", "axes", "size", "slope", "ring_radius", "length", *usual):
            value, asked = getattr(self, key), key in _KEYS[self.kind]
            if not asked and value != usual.get(key):
                keys = " and ".join(_KEYS[self.kind])
                raise InputError(f"{where}.{key}", value, f"{_a(self.kind)} has none; it has {keys}")
            if asked and value is None:
                raise InputError(f"{where}.{key}", None, f"{_a(self.kind)} needs it; add it")
        if self.radius is not None:
            radius = checks.number(f"{where}.radius", self.radius, at_least=0)
            if self.kind != "sphere" and not radius:
                raise InputError(f"{where}.radius", radius, f"a {self.kind} has a radius above 0; a vertex is a sphere")
            checks.assign(self, radius=radius)
        if self.length is not None:
            length = checks.number(f"{where}.length", self.length, at_least=0)
            if not length:
                raise InputError(f"{where}.length", length, "give one above 0; without it this is a sphere or a circle")
            checks.assign(self, length=length)
        self._check_walls(where)
        for key in ("axes", "size"):
            if getattr(self, key) is not None:
                found = checks.vector(f"{where}.{key}", getattr(self, key))
                if min(found) <= 0:
                    raise InputError(f"{where}.{key}", found, "each must be above 0")
                checks.assign(self, **{key: found})
        if self.axes is not None and max(self.axes) > _FLATTEST * min(self.axes):
            advice = f"the largest may be at most {_FLATTEST:g} times the smallest; a flat disc is a circle"
            raise InputError(f"{where}.axes", self.axes, advice)

    def _check_walls(self, key: str) -> None:
        """Raises InputError for the numbers of a cone or torus that no such wall has."""
        if self.slope is not None:
            slope = checks.number(f"{key}.slope", self.slope, at_least=0)
            if not 0 < slope < np.pi / 2:
                raise InputError(f"{key}.slope", slope, "must lie between 0 and a right angle, pi/2")
            checks.assign(self, slope=slope)
        if self.ring_radius is not None:
            ring = checks.number(f"{key}.ring_radius", self.ring_radius)
            if not ring > (self.radius or 0.0):
                raise InputError(f"{key}.ring_radius", ring, f"must be above that of the wire, {self.radius:g}")
            checks.assign(self, ring_radius=ring)

    @cached_property
    def frame(self) -> Array:
        """Axes in the body's frame, as columns; z is the normal of a plane or a circle, or the ``axis``."""
        if "axis" in _KEYS[self.kind]:
            return read_only(rotations.frame_of_axis(self.axis))
        if self.kind in {"plane", "circle"}:
            return read_only(rotations.frame_of_axis(self.normal))
        return read_only(rotations.from_rpy(self.orientation))

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """Shapes that touch, in the body's frame: one, the eight vertices of a box, or the ends of a long body."""
        centre = np.array(self.position)
        if self.kind == "plane":
            return (HalfSpace(centre, np.array(self.normal)),)
        if self.kind in CURVED:
            return (self._curved(centre, np.array(self.axis)),)
        if self.kind == "box":
            corners = itertools.product((-0.5, 0.5), repeat=3)
            return tuple(SphereShape(centre + self.frame @ (np.array(self.size) * corner), 0.0) for corner in corners)
        if self.kind == "ellipsoid":
            return (EllipsoidShape(centre, np.array(self.axes), self.frame),)
        radius, half = self.radius or 0.0, 0.5 * (self.length or 0.0) * np.array(self.axis)
        centres = (centre,) if self.length is None else (centre - half, centre + half)
        if self.kind in {"circle", "cylinder"}:
            normal = np.array(self.normal if self.kind == "circle" else self.axis)
            return tuple(CircleShape(middle, radius, normal) for middle in centres)
        return tuple(SphereShape(middle, radius) for middle in centres)

    @property
    def solid(self) -> Shape:
        """The whole shape, in the body's frame, as it meets others than planes."""
        if self.kind == "box":
            return BoxShape(np.array(self.position), np.array(self.size) / 2, self.frame)
        if self.kind in {"capsule", "cylinder"}:
            kind = CapsuleShape if self.kind == "capsule" else CylinderShape
            return kind(np.array(self.position), np.array(self.axis), 0.5 * (self.length or 0.0), self.radius or 0.0)
        return self.shapes[0]

    def _curved(self, point: Array, axis: Array) -> CurvedWall:
        if self.kind == "cone":
            return ConeWall(point, axis, self.slope or 0.0)
        if self.kind == "torus":
            return TorusWall(point, axis, self.ring_radius or 0.0, self.radius or 0.0)
        return {"bore": Bore, "shaft": Shaft, "bowl": BowlWall}[self.kind](point, axis, self.radius or 0.0)


@dataclass(frozen=True)
class DeclaredGeometry(Geometry):
    """A wall at rest in the world that the class of a package describes; files name it in ``[[surfaces]]`` alone.

    Attributes:
        surface: in metres.
        metre: a metre in the unit of length of the mechanism.
    """

    surface: Declared | None = None
    metre: float = field(default=1.0, metadata=METRES)

    @override
    def __post_init__(self) -> None:
        checks.name(self.name, "geometries")

    @cached_property
    @override
    def frame(self) -> Array:
        return read_only(np.eye(3))

    @cached_property
    @override
    def shapes(self) -> tuple[Shape, ...]:
        assert self.surface is not None  # by `declared_wall`
        return (DeclaredWall(np.zeros(3), np.array(Z), self.surface, self.metre),)


def declared_wall(name: str, surface: Declared) -> Geometry:
    """Geometry of a declared surface."""
    return DeclaredGeometry(name, WORLD, cast(GeometryKind, "declared"), surface=surface)


@dataclass(frozen=True)
class Pair:
    """Two geometries that may touch, and their contact law; geometries without a pair pass through each other.

    Attributes:
        name: unique among pairs.
        geometries: names of the two; reported forces act on the body of the first.
        friction: Coulomb's coefficient; inf: a pair that never slips. A file may give it as a table,
            ``{static = 0.5, kinetic = 0.3}``.
        restitution: normal speed after an impact over that before it, from 0 to 1.
        static_friction: coefficient while a contact sticks, at least that of a slip; left out: the same.
        tangential_restitution: a contact that sticks in an impact leaves it with minus this part of its slip before,
            as far as friction allows, from -1 to 1; 0: without slip.
        rolling_resistance: largest moment against rolling over the normal force [m].
        spinning_friction: largest moment against spin about the normal over the normal force [m].
        against: law of rolling resistance where the pair slips: against the ``turning`` of the bodies, or against the
            ``motion`` of a ball's centre over a plane or a curved wall; while a ball rolls both are one.
        cone: bounds of friction. "separate": sliding, spin and rolling have their own ones; "shared": what one takes
            the others lack, as force over ``friction`` and moments over their coefficients are together at most the
            normal force, by the root of the sum of their squares, and oppose slip and turning with most power.
    """

    name: str
    geometries: tuple[str, str]
    friction: float = field(metadata=RATIO)
    restitution: float = field(default=0.0, metadata=RATIO)
    static_friction: float | None = field(default=None, metadata=RATIO)
    tangential_restitution: float = field(default=0.0, metadata=RATIO)
    rolling_resistance: float = field(default=0.0, metadata=METRES)
    spinning_friction: float = field(default=0.0, metadata=METRES)
    against: Against = "turning"
    cone: Cone = "separate"

    def __post_init__(self) -> None:
        where = f"pairs.{checks.name(self.name, 'pairs')}"
        if len(self.geometries) != 2:
            raise InputError(f"{where}.geometries", self.geometries, "give the names of two")
        checks.assign(self, geometries=tuple(self.geometries))
        checks.read(self, where, checks.number, "friction", at_least=0, bounded=False)
        checks.read(self, where, checks.number, "rolling_resistance", "spinning_friction", at_least=0)
        require_known(f"{where}.against", self.against, get_args(Against))
        require_known(f"{where}.cone", self.cone, get_args(Cone))
        if self.cone == "shared":
            check_shared(where, self)
        checks.read(self, where, checks.number, "restitution", at_least=0)
        if self.restitution > 1:
            advice = "no impact returns more than it takes; give 0 to 1"
            raise InputError(f"{where}.restitution", self.restitution, advice)
        checks.read(self, where, checks.number, "tangential_restitution", at_least=-1)
        if self.tangential_restitution > 1:
            advice = "no impact returns more slip than it takes; give -1 to 1"
            raise InputError(f"{where}.tangential_restitution", self.tangential_restitution, advice)
        if self.static_friction is not None:
            checks.read(self, where, checks.number, "static_friction", at_least=0)
            if not 0 < self.friction <= self.static_friction:
                advice = f"kinetic friction, {self.friction:g}, must lie above 0 and not above it"
                raise InputError(f"{where}.static_friction", self.static_friction, advice)

    @property
    def static(self) -> float:
        """Coefficient of a contact that sticks."""
        return self.friction if self.static_friction is None else self.static_friction

    def with_friction(self, friction: float) -> Pair:
        """The pair with another coefficient; its static one changes by the same factor."""
        if self.cone == "shared" and not friction:
            return Pair(self.name, self.geometries, friction, self.restitution)
        if self.static_friction is None or not friction:
            return replace(self, friction=friction, static_friction=None)
        return replace(self, friction=friction, static_friction=self.static * friction / self.friction)


@dataclass(frozen=True)
class BodyContact:
    """A possible contact of two bodies: of a pair, or of a vertex of a box or an end of a capsule or cylinder.

    Attributes:
        name: of the pair; on a plane a box adds ``.1`` to ``.8``, a capsule or cylinder ``.1`` and ``.2``; two boxes
            add ``.1`` to ``.24``, a box and a capsule ``.1`` to ``.22``.
        body_a, body_b: of the first and the second geometry.
        shape_a, shape_b: in the frames of these; one of them may be a wall, and a solid meets spheres and solids.
        friction, restitution: of the pair.
        pair: its name.
        static_friction: coefficient while it sticks; None: the same.
        tangential_restitution: of the pair.
        rolling_resistance, spinning_friction: of the pair [m].
        against, cone: see :class:`Pair`.
        slot: number among the contacts of two boxes, or of a box and a capsule.
        bound: largest friction without a normal force; always 0 between bodies [N].
        presses: True, as it has a normal force.
        pressed_by: None, as the force that bounds its friction is its own.
    """

    bound: ClassVar[float] = 0.0
    presses: ClassVar[bool] = True
    pressed_by: ClassVar[None] = None
    name: str
    body_a: str
    body_b: str
    shape_a: Shape
    shape_b: Shape
    friction: float
    restitution: float
    pair: str = ""
    static_friction: float | None = None
    tangential_restitution: float = 0.0
    rolling_resistance: float = 0.0
    spinning_friction: float = 0.0
    against: Against = "turning"
    cone: Cone = "separate"
    slot: int = 0

    @property
    def shared_arms(self) -> tuple[float, ...]:
        """Moments that a shared cone holds over its force of sliding [m]: of spin, and of rolling about two axes."""
        if self.cone == "separate":
            return ()
        rolling = (self.rolling_resistance,) * 2 if self.rolling_resistance else ()
        return tuple(moment / self.friction for moment in (self.spinning_friction, *rolling))

    @property
    def static(self) -> float:
        """Coefficient of the contact while it sticks."""
        return self.friction if self.static_friction is None else self.static_friction

    @property
    def bend(self) -> float:
        """1 over the radius of a ball whose motion is resisted, negative if it is of body b [1/m]; 0: turning is."""
        if self.against == "turning":
            return 0.0
        shape, sign = (self.shape_a, 1.0) if isinstance(self.shape_a, SphereShape) else (self.shape_b, -1.0)
        assert isinstance(shape, SphereShape)  # by `require_rule`
        return sign / shape.radius

    @cached_property
    def features(self) -> SolidFeatures | None:
        """Features by which solids meet; None: the shapes have one rule."""
        return features_between(self.shape_a, self.shape_b)

    @cached_property
    def box_slot(self) -> BoxSlot | CapsuleBoxSlot | None:
        """The contact as one of a box and another box or a capsule; None: it is of other shapes."""
        a, b = self.shape_a, self.shape_b
        if isinstance(a, BoxShape) and isinstance(b, BoxShape):
            return BoxSlot(a, b, self.slot)
        if isinstance(a, CapsuleShape) and isinstance(b, BoxShape):
            return CapsuleBoxSlot(a, b, self.slot, capsule_first=True)
        if isinstance(a, BoxShape) and isinstance(b, CapsuleShape):
            return CapsuleBoxSlot(b, a, self.slot, capsule_first=False)
        return None

    @property
    def has_tip(self) -> bool:
        """True if one of the shapes is a cone, whose tip has no normal."""
        return isinstance(self.shape_a, ConeWall) or isinstance(self.shape_b, ConeWall)

    @property
    def may_lie(self) -> bool:
        """True if one of the shapes is a circle, which may lie flat, or a cone."""
        return self.has_tip or isinstance(self.shape_a, CircleShape) or isinstance(self.shape_b, CircleShape)


def contacts_of(geometries: Sequence[Geometry], pairs: Sequence[Pair]) -> tuple[BodyContact, ...]:
    """Contacts of all pairs, in their order. Raises InputError if a pair cannot touch or is listed twice."""
    by_name = {geometry.name: geometry for geometry in geometries}
    contacts: list[BodyContact] = []
    listed: dict[frozenset[str], str] = {}
    for pair in pairs:
        key = f"pairs.{pair.name}.geometries"
        for name in pair.geometries:
            require_known(key, name, by_name, "there is no such geometry; choose from")
        a, b = (by_name[name] for name in pair.geometries)
        if a.body == b.body:
            owner = "the world" if a.body == WORLD else f"the body {a.body}"
            raise InputError(key, pair.geometries, f"both belong to {owner}, which cannot touch itself")
        if frozenset(pair.geometries) in listed:
            advice = f"these are the pair {listed[frozenset(pair.geometries)]} already; remove one"
            raise InputError(key, pair.geometries, advice)
        listed[frozenset(pair.geometries)] = pair.name
        require_rule(key, pair, a, b)
        slots = {("box",): BoxSlot.count, ("box", "capsule"): CapsuleBoxSlot.count}
        touching = [(a.solid, b.solid)] * slots.get(tuple(sorted({a.kind, b.kind})), 1)
        if "plane" in {a.kind, b.kind}:
            touching = list(itertools.product(a.shapes, b.shapes))
        for number, (shape_a, shape_b) in enumerate(touching, 1):
            name = pair.name if len(touching) == 1 else f"{pair.name}.{number}"
            contacts.append(
                BodyContact(
                    name=name,
                    body_a=a.body,
                    body_b=b.body,
                    shape_a=shape_a,
                    shape_b=shape_b,
                    friction=pair.friction,
                    restitution=pair.restitution,
                    pair=pair.name,
                    static_friction=pair.static_friction,
                    tangential_restitution=pair.tangential_restitution,
                    rolling_resistance=pair.rolling_resistance,
                    spinning_friction=pair.spinning_friction,
                    against=pair.against,
                    cone=pair.cone,
                    slot=number - 1,
                )
            )
    return tuple(contacts)


def shared_pairs(contacts: Sequence[BodyContact]) -> dict[str, list[int]]:
    """Indices of the contacts of each pair that has several, by its name."""
    by_pair: dict[str, list[int]] = {}
    for k, contact in enumerate(contacts):
        by_pair.setdefault(contact.pair, []).append(k)
    return {name: numbers for name, numbers in by_pair.items() if len(numbers) > 1}


def carried_bodies(contacts: Sequence[BodyContact]) -> tuple[str, ...]:
    """Names of the bodies that touch in several pairs, in the order of their contacts."""
    pairs: dict[str, set[str]] = {}
    for contact in contacts:
        for body in (contact.body_a, contact.body_b):
            pairs.setdefault(body, set()).add(contact.pair)
    return tuple(body for body, names in pairs.items() if len(names) > 1 and body != WORLD)


def contact_sums(contacts: Sequence[BodyContact]) -> Array:
    """Signed matrix that sums forces of contacts, (sums, contacts).

    First over each of the :func:`shared_pairs`, on its first body, then on each of the :func:`carried_bodies`.
    """
    sums = [np.isin(np.arange(len(contacts)), numbers).astype(float) for numbers in shared_pairs(contacts).values()]
    for body in carried_bodies(contacts):
        sums.append(np.array([(contact.body_a == body) - float(contact.body_b == body) for contact in contacts]))
    return np.array(sums).reshape(len(sums), len(contacts))


def turned_bodies(contacts: Sequence[BodyContact]) -> tuple[str, ...]:
    """Names of the bodies that touch at several points, in the order of contacts; without those that may lie flat."""
    of_bodies: dict[str, list[BodyContact]] = {}
    for contact in contacts:
        for body in (contact.body_a, contact.body_b):
            of_bodies.setdefault(body, []).append(contact)
    several = {body: own for body, own in of_bodies.items() if len(own) > 1 and body != WORLD}
    return tuple(body for body, own in several.items() if not any(contact.may_lie for contact in own))


def contact_moments(contacts: Sequence[BodyContact], centres: Sequence[Array], places: Array, forces: Array) -> Array:
    """Moments of forces of contacts, (…, contacts, 3), on each of the :func:`turned_bodies`, (…, bodies, 3).

    ``centres``: centre of mass of each of them, (…, 3), about which they turn it; ``places``: as ``forces``.
    """
    moments = []
    for body, centre in zip(turned_bodies(contacts), centres, strict=True):
        signs = np.array([(contact.body_a == body) - float(contact.body_b == body) for contact in contacts])
        moments.append(signs @ cross(places - centre[..., None, :], forces))
    return np.stack(moments, axis=-2) if moments else np.zeros((*forces.shape[:-2], 0, 3))


def _a(kind: str) -> str:
    return f"an {kind}" if kind == "ellipsoid" else f"a {kind}"
