"""Joints of the tree: data, frames and coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from proofroll.core.arrays import read_only
from proofroll.core.errors import InputError, require_known
from proofroll.core.parameters import Unit
from proofroll.elements.mechanism.scene import checks, rotations
from proofroll.elements.mechanism.scene.checks import METRES, RADIANS, RATIO, WORLD, ZERO, Numbers, Vector, Z
from proofroll.elements.mechanism.scene.joint_kinds import (
    FACTS,
    LAWS,
    ONE_COORDINATE,
    WITH_AXIS,
    WITH_QUATERNION,
    JointKind,
)
from proofroll.elements.mechanism.scene.prescribed import checked_motion
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import Formula, Signal, Table, checked, varies

_O, _UNIT = np.zeros(3), np.eye(3)
AT_STOP = 1e-9  # relative to the range between stops: a joint may start so far beyond a stop, by rounding in a file
_START = 1e-9  # largest difference of q0 and v0 from a motion at time 0, relative to the largest of them
_LENGTHS, _SPEEDS = ("m", "m", "m"), ("m/s", "m/s", "m/s")
_ABOUT: dict[str, dict[str, Unit]] = {
    "q": {
        JointKind.SPHERICAL: "1",
        JointKind.CYLINDRICAL: ("m", "rad"),
        JointKind.PLANAR: ("m", "m", "rad"),
        JointKind.FREE: (*_LENGTHS, "1", "1", "1", "1"),
    },
    "v": {
        JointKind.SPHERICAL: "rad/s",
        JointKind.CYLINDRICAL: ("m/s", "rad/s"),
        JointKind.PLANAR: ("m/s", "m/s", "rad/s"),
        JointKind.FREE: (*_SPEEDS, "rad/s", "rad/s", "rad/s"),
    },
    "damping": {JointKind.SPHERICAL: "N m s/rad"},
}
# Units along a coordinate, by kind of joint: turning, sliding, other.
UNITS: dict[str, dict[str, dict[str, Unit]]] = {
    name: {
        "unit": {
            JointKind.REVOLUTE: turning,
            JointKind.UNIVERSAL: turning,
            JointKind.PRISMATIC: sliding,
            **_ABOUT.get(name, {}),
        }
    }
    for name, turning, sliding in (
        ("q", "rad", "m"),
        ("coordinate", "rad", "m"),
        ("v", "rad/s", "m/s"),
        ("stiffness", "N m/rad", "N/m"),
        ("damping", "N m s/rad", "N s/m"),
        ("effort", "N m", "N"),
        ("armature", "kg m^2", "kg"),
    )
}


@dataclass(frozen=True)
class Joint:
    """A joint of the tree: it alone connects its child to its parent.

    At q = 0 the child's axes are the parent's turned by ``orientation``. Two frames meet in the joint: A on the parent
    and B on the child, both with z along the axis (:attr:`parent_frame`, :attr:`child_frame`). Coordinates, and
    velocities, which are their rates unless noted:

    * revolute: angle about z; prismatic: B's origin along z of A;
    * cylindrical: B's origin along z of A, angle about z;
    * universal: angle about z of A (``axis``, fixed in the parent), then angle about x of B (``second_axis``, fixed in
      the child), which is perpendicular to it;
    * planar: B's origin along x and y of A, angle about z;
    * spherical: unit quaternion wxyz of B in A; velocity: angular velocity relative to the parent, in the child's axes;
    * free: B's origin in A, then a unit quaternion; velocity: linear, then angular, relative to the parent, both in the
      child's axes.

    Attributes:
        name: unique among joints and loops.
        kind: relative motion of its two bodies that it allows.
        parent, child: names of bodies; the parent may be ``world``.
        position: of the joint in the parent's frame [m].
        orientation: roll, pitch, yaw (fixed axes x, y, z) of the child's frame against the parent's at q = 0 [rad].
        axis: in the child's frame; of all but fixed, spherical and free joints; of planar ones the plane's normal.
        second_axis: in the child's frame, perpendicular to ``axis``: second axis of a universal joint, x of a planar
            one; None: any perpendicular (x of the child, where it can be).
        child_position: of the joint in the child's frame [m].
        q0, v0: coordinates and velocities at the start; default: zero.
        stiffness, damping: of a spring and damper along each coordinate.
        rest: coordinate at which the spring has no force.
        friction: largest dry friction.
        torque: drive; a number, a formula ``"= 0.3*sin(2*pi*t)"``, or a table ``{times = [..], values = [..]}``.
        motion: coordinate that an ideal drive imposes, of a revolute or prismatic joint: a number, a formula
            ``"= 0.02*sin(40*t)"`` or a table, which a spline of fifth order joins, at rest outside; q0 and v0 follow.
        armature: inertia of the drive along the coordinate, added to that of the bodies.
        limits: least and greatest coordinate of a revolute or prismatic joint, where stops are; None: no stops.
        restitution: speed after an impact on a stop over the speed before it, from 0 to 1.
        dependent: q0 and v0 are to be found from the loops, with q0 as a guess; False for all joints of a mechanism
            that is assembled.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    position: Vector = field(default=ZERO, metadata=METRES)
    orientation: Vector = field(default=ZERO, metadata=RADIANS)
    axis: Vector = field(default=Z, metadata=RATIO)
    second_axis: Vector | None = field(default=None, metadata=RATIO)
    child_position: Vector = field(default=ZERO, metadata=METRES)
    q0: Numbers = field(default=(), metadata=UNITS["q"])
    v0: Numbers = field(default=(), metadata=UNITS["v"])
    stiffness: float = field(default=0.0, metadata=UNITS["stiffness"])
    rest: float = field(default=0.0, metadata=UNITS["coordinate"])
    damping: float = field(default=0.0, metadata=UNITS["damping"])
    friction: float = field(default=0.0, metadata=UNITS["effort"])
    torque: float | Formula | Table = field(default=0.0, metadata={**UNITS["effort"], "signal": True})
    motion: float | Formula | Table | None = field(default=None, metadata={**UNITS["coordinate"], "signal": True})
    armature: float = field(default=0.0, metadata=UNITS["armature"])
    limits: tuple[float, float] | None = field(default=None, metadata=UNITS["coordinate"])
    restitution: float = field(default=0.0, metadata=RATIO)
    dependent: bool = False

    def __post_init__(self) -> None:
        where = f"joints.{checks.name(self.name, 'joints')}"
        require_known(f"{where}.kind", self.kind, FACTS)
        checks.assign(self, kind=JointKind(self.kind))
        if self.parent == self.child:
            raise InputError(f"{where}.child", self.child, "a joint connects two bodies; parent and child are the same")
        if self.child == WORLD:
            raise InputError(f"{where}.child", WORLD, "the world cannot be a child; exchange parent and child")
        checks.read(self, where, checks.vector, "position", "orientation", "child_position")
        checks.read(self, where, checks.axis, "axis")
        if self.kind not in WITH_AXIS and (self.axis != Z or self.second_axis is not None):
            raise InputError(f"{where}.axis", self.axis, f"a {self.kind} joint has no axis; remove it")
        if self.second_axis is not None:
            second = checks.axis(f"{where}.second_axis", self.second_axis)
            if abs(np.dot(second, self.axis)) > 1e-9:
                raise InputError(f"{where}.second_axis", self.second_axis, "must be perpendicular to axis")
            checks.assign(self, second_axis=second)
        self._check_motion(where)
        self._check_start(where)
        for key, kinds in LAWS.items():
            least = None if key in {"rest", "torque"} else 0.0
            given, here = getattr(self, key), f"{where}.{key}"
            moving = key == "torque" and varies(given)
            value = checked(here, given) if moving else checks.number(here, given, at_least=least)
            if value and self.kind not in kinds:
                raise InputError(f"{where}.{key}", value, f"a {self.kind} joint has none; it is for {', '.join(kinds)}")
            checks.assign(self, **{key: value})
        if self.limits is not None:
            low, high = checks.numbers(f"{where}.limits", self.limits, 2)
            if self.nq != 1 or low >= high:
                advice = "a joint with several has no stops" if self.nq > 1 else "the first must be below the second"
                advice = f"give [least, greatest] of the joint's coordinate; {advice}"
                raise InputError(f"{where}.limits", self.limits, advice)
            checks.assign(self, limits=(low, high))
            if not low - self.stop_digits <= self.q0[0] <= high + self.stop_digits:
                advice = f"the joint starts beyond a stop; its limits are {low:g} and {high:g}"
                raise InputError(f"{where}.q0", self.q0[0], advice)
        self._check_restitution(where)

    def _check_motion(self, key_path: str) -> None:
        """Takes q0 and v0 from a motion. Raises InputError if the motion and other data contradict each other."""
        if self.motion is None:
            return
        if self.kind not in ONE_COORDINATE:
            raise InputError(
                f"{key_path}.motion",
                str(self.motion),
                f"a {self.kind} joint has none; it is for {', '.join(ONE_COORDINATE)}",
            )
        for key in ("friction", "limits", "dependent"):
            if value := getattr(self, key):
                advice = "the motion of the joint is prescribed, so that this changes nothing; remove it or the motion"
                raise InputError(f"{key_path}.{key}", value, advice)
        signal: Signal = checked(f"{key_path}.motion", self.motion)
        place, rate, _ = checked_motion(f"{key_path}.motion", signal)
        for key, value in (("q0", place), ("v0", rate)):
            start = getattr(self, key)
            if not _none(start):
                (number,) = checks.numbers(f"{key_path}.{key}", start, 1)
                if abs(number - value) > _START * max(abs(number), abs(value)):
                    raise InputError(f"{key_path}.{key}", number, f"the motion begins with {value:g}; leave {key} out")
        checks.assign(self, motion=signal, q0=(place,), v0=(rate,))

    @property
    def stop_digits(self) -> float:
        """Distance from a stop that counts as none [rad or m]; 0 without stops."""
        return AT_STOP * (self.limits[1] - self.limits[0]) if self.limits else 0.0

    def _check_restitution(self, key_path: str) -> None:
        value = checks.number(f"{key_path}.restitution", self.restitution, at_least=0)
        if value > 1:
            raise InputError(f"{key_path}.restitution", value, "no impact returns more than it takes; give 0 to 1")
        if value and self.limits is None:
            raise InputError(
                f"{key_path}.restitution", value, "there is no stop without limits; add them or leave it out"
            )
        checks.assign(self, restitution=value)

    def _check_start(self, key_path: str) -> None:
        zero = [0.0] * self.nq
        if self.kind in WITH_QUATERNION:
            zero[-4] = 1.0
        q0 = list(checks.numbers(f"{key_path}.q0", zero if _none(self.q0) else self.q0, self.nq))
        if self.kind in WITH_QUATERNION:
            length = float(np.linalg.norm(q0[-4:]))
            if length == 0.0:
                raise InputError(
                    f"{key_path}.q0", self.q0, "a quaternion of length zero is no rotation; give a unit one"
                )
            q0[-4:] = [component / length for component in q0[-4:]]
        v0 = checks.numbers(f"{key_path}.v0", [0.0] * self.nv if _none(self.v0) else self.v0, self.nv)
        checks.assign(self, q0=tuple(q0), v0=v0)

    @property
    def constant_drive(self) -> float:
        """The drive [N, N m]; zero where it changes in time."""
        return 0.0 if varies(self.torque) else float(self.torque)  # type: ignore[arg-type]  # what does not vary is a number

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return FACTS[self.kind].nq

    @property
    def unit(self) -> str:
        """Unit of the coordinate of a joint that has one."""
        return "rad" if self.kind == JointKind.REVOLUTE else "m"

    @property
    def nv(self) -> int:
        """Number of velocities."""
        return FACTS[self.kind].nv

    @cached_property
    def child_frame(self) -> Array:
        """Axes of the joint's frame B in the child's axes, as columns: z is the axis."""
        turned = self.kind in WITH_AXIS
        return read_only(rotations.frame_of_axis(self.axis, self.second_axis) if turned else np.eye(3))

    @cached_property
    def parent_frame(self) -> Array:
        """Axes of the joint's frame A in the parent's axes, as columns; A and B coincide at q = 0."""
        return read_only(rotations.from_rpy(self.orientation) @ self.child_frame)


def _none(values: object) -> bool:
    return isinstance(values, tuple | list) and not values


def child_in_parent(kind: str, q: Array) -> tuple[Array, Array]:
    """Pose of frame B in frame A for a joint of this kind at q, (nq): origin [m] and rotation matrix."""
    origin, rotation = _O, _UNIT
    if kind == JointKind.REVOLUTE:
        rotation = rotations.about(2, q[0])
    elif kind == JointKind.PRISMATIC:
        origin = np.array([0.0, 0.0, q[0]])
    elif kind == JointKind.CYLINDRICAL:
        origin, rotation = np.array([0.0, 0.0, q[0]]), rotations.about(2, q[1])
    elif kind == JointKind.UNIVERSAL:
        rotation = rotations.about(2, q[0]) @ rotations.about(0, q[1])
    elif kind == JointKind.SPHERICAL:
        rotation = rotations.from_quaternion(q)
    elif kind == JointKind.PLANAR:
        origin, rotation = np.array([q[0], q[1], 0.0]), rotations.about(2, q[2])
    elif kind == JointKind.FREE:
        origin, rotation = q[:3], rotations.from_quaternion(q[3:])
    return origin, rotation


def coordinate_rate(kind: str, q: Array, v: Array) -> Array:
    """Rate of a joint's coordinates, (nq), for coordinates q and velocities v, (nv)."""
    if kind == JointKind.SPHERICAL:
        return rotations.quaternion_rate(q, v)
    if kind == JointKind.FREE:
        return np.concatenate([rotations.from_quaternion(q[3:]) @ v[:3], rotations.quaternion_rate(q[3:], v[3:])])
    return v
