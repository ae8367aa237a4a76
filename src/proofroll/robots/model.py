"""Robot as data: bodies and the joints between them, described by a file and used by both formulations."""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray, slices
from proofroll.elements.mechanism.scene.joint_kinds import FACTS, ONE_COORDINATE, JointKind

Array = FloatArray  # its short name, for signatures of robots
# Parent of joints in the world. It is no name of a body or joint: many root links are called ``world``.
NO_BODY = ""
# Relative violation of inertia's inequalities that counts as round-off of the file's digits.
_ROUNDING = 1e-9
# Degrees of freedom of each kind of joint.
DOFS: Mapping[str, int] = {
    kind: FACTS[kind].nv for kind in (JointKind.FIXED, *ONE_COORDINATE, JointKind.SPHERICAL, JointKind.FREE)
}


@dataclasses.dataclass(frozen=True)
class RobotBody:
    """A rigid body.

    Attributes:
        name: unique.
        mass: [kg].
        com: centre of mass in the body's frame [m], shape (3,).
        inertia: about the centre of mass, in the body's axes [kg m²], shape (3, 3).
        compensation: part of its weight that a force at the centre of mass carries [1].
    """

    name: str
    mass: float
    com: Array
    inertia: Array
    compensation: float = 0.0

    @property
    def moments(self) -> Array:
        """Principal moments, smallest first, shape (3,)."""
        return np.asarray(np.linalg.eigvalsh(self.inertia), dtype=np.float64)

    @property
    def impossible(self) -> str:
        """Reason that no rigid body has this inertia, beyond round-off; empty: one may."""
        a, b, c = self.moments
        if a < -_ROUNDING * np.abs(self.inertia).max():
            return f"is not positive definite (smallest moment {a:.3g} kg m²)"
        return f"breaks the triangle inequality ({c:.3g} > {a:.3g} + {b:.3g} kg m²)" if self.breaks_triangle else ""

    @property
    def breaks_triangle(self) -> bool:
        """True if the largest principal moment exceeds the sum of the others by more than round-off."""
        small, middle, large = self.moments
        return bool(large > (small + middle) * (1 + _ROUNDING))


@dataclasses.dataclass(frozen=True)
class RobotJoint:
    """A joint that connects a child body to its parent.

    Attributes:
        name: unique.
        kind: a key of :data:`DOFS`.
        parent: a body, or :data:`NO_BODY`.
        child: a body.
        position: of the joint in the parent's frame [m], shape (3,); for a free joint, an offset of its coordinates.
        rotation: of the child's frame against the parent's at coordinate 0, shape (3, 3).
        axis: unit vector in the child's frame, shape (3,).
        child_position: of the joint in the child's frame [m], shape (3,).
        damping: torque per velocity [N m s/rad or N s/m].
        friction: Coulomb torque [N m or N].
        armature: inertia added to the joint's own coordinate [kg m² or kg].
        stiffness: spring torque per coordinate [N m/rad or N/m].
        rest: coordinate at which the spring is at rest [rad or m].
        lower, upper: limits of the coordinate, of a spherical joint the largest angle [rad or m]; None: there is none.
        effort: largest size of the effort of all its drives [N m or N]; None: none is given.
        speed: largest velocity of its drive [rad/s or m/s]; None: none is given.
        actuated: True if an actuator acts on the joint.
        turning: True if the armature of a free joint acts along the body's axes, False: along the world's.
        ref: number that the file gives the joint in its pose, where its coordinate here is 0 [rad or m].
    """

    name: str
    kind: str
    parent: str
    child: str
    position: Array
    rotation: Array
    axis: Array
    child_position: Array = dataclasses.field(default_factory=lambda: np.zeros(3))
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    lower: float | None = None
    upper: float | None = None
    effort: float | None = None
    speed: float | None = None
    actuated: bool = False
    turning: bool = False
    ref: float = 0.0

    @property
    def dofs(self) -> int:
        """Number of velocities of the joint."""
        return DOFS[self.kind]


@dataclasses.dataclass(frozen=True)
class RobotActuator:
    """A motor at a joint through a gear g: effort g (gain · control + bias − kp g q − kd g dq/dt), q counted from 0.

    Attributes:
        name: unique among actuators.
        joint: the joint that it drives.
        gear: turns of the motor per turn of the joint.
        gain: effort per control.
        bias: constant effort [N m or N].
        kp: gain of the motor's position [N m/rad or N/m].
        kd: gain of the motor's velocity [N m s/rad or N s/m].
        ends: lowest and highest control; None: it has no range.
        limit: largest size of its effort at the joint [N m or N]; None: there is none.
        unlike: clause on a law that none of these represents; empty: they say all.
    """

    name: str
    joint: str
    gear: float
    gain: float
    bias: float
    kp: float
    kd: float
    ends: tuple[float, float] | None
    limit: float | None
    unlike: str


@dataclasses.dataclass(frozen=True)
class Mimic:
    """A joint that follows another: q = multiplier · q_other + offset."""

    joint: str
    other: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclasses.dataclass(frozen=True)
class RobotLoop:
    """A constraint that closes the tree: two bodies share a point, or are fixed to each other.

    Attributes:
        name: of the constraint.
        kind: ``spherical`` or ``fixed``.
        body_a, body_b: bodies, or :data:`NO_BODY`.
        position_a, position_b: the shared point in each body's frame [m], shape (3,).
        rotation: of body_b's frame against body_a's, held by a fixed loop, shape (3, 3).
    """

    name: str
    kind: str
    body_a: str
    body_b: str
    position_a: Array
    position_b: Array
    rotation: Array


@dataclasses.dataclass(frozen=True)
class Tie:
    """A sum of coordinates, each times its coefficient, that has a fixed value, as of a tendon [rad or m]."""

    name: str
    joints: tuple[str, ...]
    coefficients: tuple[float, ...]
    value: float = 0.0


@dataclasses.dataclass(frozen=True)
class Cord:
    """A tendon between two places that pulls where it is as long as it can be.

    Attributes:
        name: of the tendon.
        body_a, body_b: bodies, or :data:`NO_BODY`.
        position_a, position_b: its ends in each body's frame [m], shape (3,).
        at_most: largest length [m].
    """

    name: str
    body_a: str
    body_b: str
    position_a: Array
    position_b: Array
    at_most: float


@dataclasses.dataclass(frozen=True)
class Robot:
    """A tree of bodies, every joint after the joint of its parent.

    Attributes:
        name: of the robot.
        bodies: by name.
        joints: parents first; one for each body.
        mimics: joints that follow another.
        loops: constraints that close the tree; a check of importers compares the tree alone.
        ties: further linear relations of joints.
        cords: tendons with a largest length.
        further: clauses on constraints and laws of tendons that none of these represents.
        actuators: of an MJCF, in the order of their controls.
        gravity: acceleration [m/s²], shape (3,).
        sources: body -> facts of the file that only hypotheses need: its inertia as written, for example.
    """

    name: str
    bodies: Mapping[str, RobotBody]
    joints: tuple[RobotJoint, ...]
    mimics: tuple[Mimic, ...] = ()
    gravity: Array = dataclasses.field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    sources: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    loops: tuple[RobotLoop, ...] = ()
    ties: tuple[Tie, ...] = ()
    cords: tuple[Cord, ...] = ()
    further: tuple[str, ...] = ()
    actuators: tuple[RobotActuator, ...] = ()

    @cached_property
    def moving(self) -> tuple[RobotJoint, ...]:
        """The joints that have velocities."""
        return tuple(joint for joint in self.joints if joint.dofs)

    @cached_property
    def columns(self) -> dict[str, slice]:
        """Moving joint -> slice of its velocities in a stacked vector."""
        spans = slices(joint.dofs for joint in self.moving)
        return {joint.name: span for joint, span in zip(self.moving, spans, strict=True)}

    @property
    def dofs(self) -> int:
        """Number of velocities, those of following joints included."""
        return sum(joint.dofs for joint in self.joints)

    @cached_property
    def welded(self) -> dict[str, tuple[str, Array, Array]]:
        """Body -> moving joint that carries it, and its position and rotation in the frame of that joint's child.

        A body that is fixed to the world has :data:`NO_BODY` instead of a joint.
        """
        welded = {NO_BODY: (NO_BODY, np.zeros(3), np.eye(3))}
        for joint in self.joints:
            if joint.dofs:
                welded[joint.child] = (joint.name, np.zeros(3), np.eye(3))
            else:
                home, p, R = welded[joint.parent]
                turned = R @ joint.rotation
                welded[joint.child] = (home, p + R @ joint.position - turned @ joint.child_position, turned)
        return welded

    def carried(self, body: str) -> tuple[str, Array, Array]:
        """Child of the joint that carries a body, or :data:`NO_BODY`; position and rotation in the frame of that."""
        home, p, R = self.welded[body]
        return next((joint.child for joint in self.moving if joint.name == home), NO_BODY), p, R

    @cached_property
    def groups(self) -> dict[str, RobotBody]:
        """Moving joint -> composite of the bodies that it carries rigidly, in the frame of the joint's child."""
        parts: dict[str, list[tuple[RobotBody, Array, Array]]] = {joint.name: [] for joint in self.moving}
        for name, (home, p, R) in self.welded.items():
            if home != NO_BODY:
                parts[home].append((self.bodies[name], p, R))
        return {name: composed(name, parts_of_joint) for name, parts_of_joint in parts.items()}

    def change(self, **changes: Any) -> Robot:
        """The robot with some attributes replaced."""
        return dataclasses.replace(self, **changes)

    def with_bodies(self, bodies: Iterable[RobotBody]) -> Robot:
        """The robot with some bodies replaced by others of the same name; itself without any."""
        replaced = {body.name: body for body in bodies}
        return self.change(bodies={**self.bodies, **replaced}) if replaced else self

    def with_each_joint(self, changed: Callable[[RobotJoint], RobotJoint]) -> Robot:
        """The robot with each joint as a function gives it; itself where that changes none."""
        joints = tuple(map(changed, self.joints))
        return self if all(map(operator.is_, joints, self.joints)) else self.change(joints=joints)

    def with_joints(self, **values: float) -> Robot:
        """The robot with attributes of all joints replaced."""
        return self.change(joints=tuple(dataclasses.replace(joint, **values) for joint in self.joints))  # type: ignore[arg-type]


def composed(name: str, parts: Iterable[tuple[RobotBody, Array, Array]]) -> RobotBody:
    """Composite of bodies, each with its position and rotation in the frame of the composite."""
    parts = list(parts)
    mass = sum(body.mass for body, _, _ in parts)
    moment = sum((body.mass * (p + R @ body.com) for body, p, R in parts), np.zeros(3))
    com = moment / mass if mass else np.zeros(3)
    inertia = np.zeros((3, 3))
    for body, p, R in parts:
        r = p + R @ body.com - com
        inertia += R @ body.inertia @ R.T + body.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return RobotBody(name, mass, com, inertia)
