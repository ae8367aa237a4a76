"""Screw, gimbal, sprung joint and cable: tables of a file that stand for simpler parts.

Screws and gimbals are read as joints in series through bodies without mass, and a screw's coupling; springs of ball
joints and free bodies as bushings; cables as a contact: truth, engines and results know these parts alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene import checks, rotations
from proofroll.elements.mechanism.scene.bushing import LARGEST, SIX_DAMPINGS, SIX_STIFFNESSES, Bushing
from proofroll.elements.mechanism.scene.checks import METRES, RADIANS, RATIO, ZERO, Numbers, Vector, Z
from proofroll.elements.mechanism.scene.drives import Coupling
from proofroll.elements.mechanism.scene.joint import UNITS, Joint
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, JointKind
from proofroll.elements.mechanism.scene.parts import Body
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula, Table

Parts = Mapping[str, Sequence[Any]]
_RATE, _STIFFNESS, _DAMPING = {"unit": "rad/s"}, {"unit": "N m/rad"}, {"unit": "N m s/rad"}
_EFFORT: dict[str, Any] = {"unit": "N m"}


@dataclass(frozen=True)
class Screw:
    """A joint whose child travels along its axis as it turns about it.

    It is a prismatic joint ``<name>.slide``, a body ``<name>.carriage`` without mass, a revolute joint ``<name>.turn``
    about the same axis, and a coupling with the joint's name, whose force is that of the thread along the axis. What it
    has along a coordinate belongs to ``<name>.turn``.

    Attributes:
        name: unique among joints and loops.
        parent, child: names of bodies; the parent may be ``world``.
        lead: travel per radian; negative for a left-hand thread.
        position: of the joint in the parent's frame [m].
        orientation: roll, pitch, yaw of the child's frame against the parent's at q = 0 [rad].
        axis: in the child's frame.
        child_position: of the joint in the child's frame [m].
        q0, v0: angle and its rate at the start.
        stiffness, damping: of a spring and damper about the axis.
        rest: angle at which the spring has no moment.
        friction: largest dry friction.
        torque: drive; a number, a formula or a table.
        motion: angle that an ideal drive imposes; a number, a formula or a table.
        limits: least and greatest angle, where stops are.
        restitution: of the stops, from 0 to 1.
        dependent: q0 and v0 are to be found from the loops.
        kind: always ``screw``.
    """

    name: str
    parent: str
    child: str
    lead: float = field(metadata={"unit": "m/rad"})
    position: Vector = field(default=ZERO, metadata=METRES)
    orientation: Vector = field(default=ZERO, metadata=RADIANS)
    axis: Vector = field(default=Z, metadata=RATIO)
    child_position: Vector = field(default=ZERO, metadata=METRES)
    q0: Numbers = field(default=(), metadata=RADIANS)
    v0: Numbers = field(default=(), metadata=_RATE)
    stiffness: float = field(default=0.0, metadata=_STIFFNESS)
    damping: float = field(default=0.0, metadata=_DAMPING)
    rest: float = field(default=0.0, metadata=RADIANS)
    friction: float = field(default=0.0, metadata=_EFFORT)
    torque: float | Formula | Table = field(default=0.0, metadata={**_EFFORT, "signal": True})
    motion: float | Formula | Table | None = field(default=None, metadata={**RADIANS, "signal": True})
    limits: tuple[float, float] | None = field(default=None, metadata=RADIANS)
    restitution: float = field(default=0.0, metadata=RATIO)
    dependent: bool = False
    kind: str = "screw"

    def parts(self) -> Parts:
        """Its parts by kind, as the tables of a file: bodies, joints, coupling.

        Raises:
            InputError: its data are wrong.
        """
        carriage, laws = f"{self.name}.carriage", ("stiffness", "damping", "rest", "friction", "torque", "motion")
        lead = checks.number(f"joints.{self.name}.lead", self.lead)
        if not lead:
            raise InputError(f"joints.{self.name}.lead", lead, "a screw without lead is a revolute joint; make it one")
        with_laws = {key: getattr(self, key) for key in (*laws, "limits", "restitution", "dependent")}
        turn = _joint(
            self, "turn", parent=carriage, child=self.child, child_position=self.child_position, axis=self.axis,
            q0=self.q0, v0=self.v0, **with_laws,
        )  # fmt: skip
        slide = _joint(
            self, "slide", JointKind.PRISMATIC, parent=self.parent, child=carriage, position=self.position,
            orientation=self.orientation, axis=self.axis, q0=(lead * turn.q0[0],), v0=(lead * turn.v0[0],),
            dependent=self.dependent,
        )  # fmt: skip
        thread = Coupling(self.name, turn.name, slide.name, lead)
        return {"bodies": [Body(carriage, 0.0)], "joints": [slide, turn], "couplings": [thread]}


@dataclass(frozen=True)
class Gimbal:
    """A ball joint by three angles: about ``axis``, fixed in the parent, about a middle axis, about one of the child.

    It is three revolute joints ``<name>.outer``, ``<name>.middle``, ``<name>.inner``, with rings ``<name>.outer`` and
    ``<name>.middle`` without mass between them. It locks where the middle angle is a quarter of a turn.

    Attributes:
        name: unique among joints and loops.
        parent, child: names of bodies; the parent may be ``world``.
        position: of the joint in the parent's frame [m].
        orientation: roll, pitch, yaw of the child's frame against the parent's at q = 0 [rad].
        axis: outer axis, in the child's frame at q = 0.
        second_axis: inner axis, in the child's frame, perpendicular to ``axis``; by default any. The middle axis is
            ``axis`` × ``second_axis`` at q = 0.
        child_position: of the joint in the child's frame [m].
        q0, v0: three angles and their rates at the start.
        stiffness, damping, rest, friction: of springs, dampers and dry friction about the axes: three numbers, or one
            for all.
        kind: always ``gimbal``.
    """

    name: str
    parent: str
    child: str
    position: Vector = field(default=ZERO, metadata=METRES)
    orientation: Vector = field(default=ZERO, metadata=RADIANS)
    axis: Vector = field(default=Z, metadata=RATIO)
    second_axis: Vector | None = field(default=None, metadata=RATIO)
    child_position: Vector = field(default=ZERO, metadata=METRES)
    q0: Numbers = field(default=(), metadata=RADIANS)
    v0: Numbers = field(default=(), metadata=_RATE)
    stiffness: Numbers = field(default=(), metadata=_STIFFNESS)
    damping: Numbers = field(default=(), metadata=_DAMPING)
    rest: Numbers = field(default=(), metadata=RADIANS)
    friction: Numbers = field(default=(), metadata=_EFFORT)
    kind: str = "gimbal"

    def parts(self) -> Parts:
        """Its parts by kind, as the tables of a file: bodies, joints.

        Raises:
            InputError: its data are wrong.
        """
        place, second = f"joints.{self.name}", self.second_axis
        axis = checks.axis(f"{place}.axis", self.axis)
        if second is not None and abs(np.dot(axis, checks.axis(f"{place}.second_axis", second))) > _RIGHT:
            raise InputError(f"{place}.second_axis", second, "must be perpendicular to axis")
        axes = rotations.frame_of_axis(axis, second)[:, [2, 1, 0]].T
        names = ("outer", "middle", "inner")
        bodies = [self.parent, *(f"{self.name}.{ring}" for ring in names[:2]), self.child]
        places: list[dict[str, Any]] = [{"position": self.position, "orientation": self.orientation}, {}]
        places.append({"child_position": self.child_position})
        values = {key: self._three(key) for key in ("q0", "v0", "stiffness", "damping", "rest", "friction")}
        joints = []
        for number, name in enumerate(names):
            of_axis: dict[str, Any] = {key: three[number] for key, three in values.items()}
            of_axis |= {key: (of_axis[key],) for key in ("q0", "v0")}
            ends = {"parent": bodies[number], "child": bodies[number + 1]}
            joints.append(_joint(self, name, axis=tuple(axes[number]), **ends, **places[number], **of_axis))
        return {"bodies": [Body(ring, 0.0) for ring in bodies[1:3]], "joints": joints}

    def _three(self, key: str) -> tuple[float, ...]:
        """Numbers about the three axes of a key."""
        value = getattr(self, key) or (0.0,)
        spread = 3 * tuple(value) if len(value) == 1 and key not in {"q0", "v0"} else value
        return checks.numbers(f"joints.{self.name}.{key}", spread if getattr(self, key) else (0.0,) * 3, 3)


@dataclass(frozen=True)
class SprungJoint:
    """A spherical or free joint with a spring: that joint, and a bushing ``<name>.spring`` at it.

    The spring has the energy ½ Σ k θ² of the rotation vector θ of the child from where it is at rest (below 3 rad), and
    ½ Σ k d² of the distance d of the joint's two points from there, along axes of the parent.

    Attributes:
        name: unique among joints and loops.
        kind: ``spherical`` or ``free``.
        parent, child: names of bodies; the parent may be ``world``.
        position: of the joint in the parent's frame [m].
        orientation: roll, pitch, yaw of the child's frame against the parent's at q = 0 [rad].
        child_position: of the joint in the child's frame [m].
        q0, v0: as of the joint.
        stiffness, damping: of a spherical joint one number for all directions, or about three axes; of a free one along
            and about three axes. The axes are the child's where the spring is at rest.
        rest: pose without load of the spring: rotation vector from q = 0 along the axes that the child has there; of a
            free joint behind the place, along the same axes.
        dependent: q0 and v0 are to be found from the loops.
    """

    name: str
    kind: Literal[JointKind.SPHERICAL, JointKind.FREE]
    parent: str
    child: str
    position: Vector = field(default=ZERO, metadata=METRES)
    orientation: Vector = field(default=ZERO, metadata=RADIANS)
    child_position: Vector = field(default=ZERO, metadata=METRES)
    q0: Numbers = field(default=(), metadata=UNITS["q"])
    v0: Numbers = field(default=(), metadata=UNITS["v"])
    stiffness: float | Numbers = field(
        default=(), metadata={"unit": {JointKind.SPHERICAL: "N m/rad", JointKind.FREE: SIX_STIFFNESSES}}
    )
    damping: float | Numbers = field(
        default=(), metadata={"unit": {JointKind.SPHERICAL: "N m s/rad", JointKind.FREE: SIX_DAMPINGS}}
    )
    rest: Numbers = field(
        default=(), metadata={"unit": {JointKind.SPHERICAL: "rad", JointKind.FREE: ("m",) * 3 + ("rad",) * 3}}
    )
    dependent: bool = False

    def parts(self) -> Parts:
        """Its parts by kind, as the tables of a file: joint, bushing.

        Raises:
            InputError: its data are wrong.
        """
        laws = {key: self._six(key, at_least=0) for key in ("stiffness", "damping")}
        damping = 0.0
        if self.kind == JointKind.SPHERICAL and len(set(laws["damping"][3:])) == 1:  # the joint's own
            damping, laws["damping"] = laws["damping"][3], (0.0,) * 6
        joint = Joint(
            self.name, self.kind, self.parent, self.child, position=self.position, orientation=self.orientation,
            child_position=self.child_position, q0=self.q0, v0=self.v0, damping=damping, dependent=self.dependent,
        )  # fmt: skip
        rest = self._six("rest")
        if np.linalg.norm(rest[3:]) >= LARGEST:
            advice = f"a rotation vector is shorter than {LARGEST:g} rad; turn the joint by its orientation"
            raise InputError(f"joints.{self.name}.rest", self.rest, advice)
        frame = rotations.from_rpy(joint.orientation)
        place = np.array(joint.position) + frame @ rest[:3]
        at_rest = frame @ rotations.from_rotation_vector(np.array(rest[3:]))
        spring = Bushing(
            f"{self.name}.spring", self.parent, self.child, position_a=tuple(place), position_b=joint.child_position,
            orientation_a=rotations.to_rpy(at_rest), **laws,
        )  # fmt: skip
        return {"joints": [joint], "bushings": [spring]}

    def _six(self, key: str, at_least: float | None = None) -> Any:
        """Numbers along and about three axes of a key; a ball joint has none along them."""
        value, turns = getattr(self, key), self.kind == JointKind.SPHERICAL
        spread = 3 * (value,) if isinstance(value, (int, float)) and turns else value
        count = 3 if turns else 6
        given = (0.0,) * count if isinstance(spread, tuple) and not spread else spread
        numbers = checks.numbers(f"joints.{self.name}.{key}", given, count, at_least=at_least)
        return (0.0,) * (6 - count) + numbers


@dataclass(frozen=True)
class Cable:
    """A cable without mass, which pulls where it is taut and goes slack: a distance that is at most its length.

    It is a pair of geometries without friction: a vertex ``<name>.b`` on body_b in a bowl ``<name>.a`` around its end
    on body_a. As of any contact, its force, which acts on body_b, is ``force.<name>.x|y|z``, and ``gap.<name>`` is its
    slack; it goes taut by an ``impact`` and slack by a ``lift_off``.

    Attributes:
        name: unique among joints, loops and pairs.
        body_a, body_b: names of bodies, or ``world``.
        position_a, position_b: its ends in the frame of each body [m].
        at_most: its length [m].
        restitution: speed along it after it goes taut over that before, from 0 to 1.
        kind: always ``distance``; without ``at_most`` it is a strut.
    """

    name: str
    body_a: str
    body_b: str
    at_most: float = field(metadata=METRES)
    position_a: Vector = field(default=ZERO, metadata=METRES)
    position_b: Vector = field(default=ZERO, metadata=METRES)
    restitution: float = field(default=0.0, metadata=RATIO)
    kind: str = "distance"

    def parts(self) -> Parts:
        """Its parts by kind, as the tables of a file: geometries, pair.

        Raises:
            InputError: its data are wrong.
        """
        place, ends = f"loops.{self.name}", (f"{self.name}.b", f"{self.name}.a")
        if self.body_a == self.body_b:
            raise InputError(f"{place}.body_b", self.body_b, "a cable connects two bodies; these are the same")
        if checks.number(f"{place}.at_most", self.at_most) <= 0:
            raise InputError(f"{place}.at_most", self.at_most, "a cable has a length above 0; a ball joint has none")
        if not 0 <= checks.number(f"{place}.restitution", self.restitution) <= 1:
            raise InputError(
                f"{place}.restitution", self.restitution, "no cable returns more than it takes; give 0 to 1"
            )
        vertex = Geometry(ends[0], self.body_b, "sphere", self.position_b, radius=0.0)
        bowl = Geometry(ends[1], self.body_a, "bowl", self.position_a, radius=self.at_most)
        return {"geometries": [vertex, bowl], "pairs": [Pair(self.name, ends, 0.0, self.restitution)]}


_RIGHT = 1e-9  # cosine of axes that count as perpendicular, as of universal joints
COMPOSED: Mapping[str, type[Any]] = {"screw": Screw, "gimbal": Gimbal}
# Keys by which a joint of a kind has a spring of its own; a ball joint has damping without one.
_SPRUNG: Mapping[str, set[str]] = {
    JointKind.SPHERICAL: {"stiffness", "rest"},
    JointKind.FREE: {"stiffness", "rest", "damping"},
}


def reader_of(kind: str, table: Mapping[str, Any], simple: type[Any]) -> type[Any]:
    """Dataclass that reads a table of a kind, ``simple`` unless its keys name something composed."""
    if kind == "joints" and _SPRUNG.get(str(table.get("kind")), set()) & table.keys():
        return SprungJoint
    if kind == "joints":
        return COMPOSED.get(str(table.get("kind")), simple)
    return Cable if kind == "loops" and table.get("kind") == DISTANCE and "at_most" in table else simple


def _joint(whole: Screw | Gimbal, name: str, kind: Any = JointKind.REVOLUTE, **data: Any) -> Joint:
    """Joint that is a part of another; a mistake in it is that of the whole, which the file has."""
    part = f"{whole.name}.{name}"
    try:
        return Joint(part, kind, **data)
    except InputError as error:
        raise InputError(error.field.replace(f".{part}.", f".{whole.name}.", 1), error.value, error.advice) from None
