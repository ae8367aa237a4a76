"""The data of a mechanism: bodies, a tree of joints, loops, springs, bushings, forces, points, drives, gravity.

SI units, angles in rad, world frame W with z up. Every body has a frame of its own; the frame of the world is the
body ``world``. Each object checks itself and raises :class:`~proofroll.core.errors.InputError` with one line.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.arrays import slices
from proofroll.core.errors import InputError, require_known
from proofroll.elements.mechanism.scene import checks
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.checks import WORLD, Vector
from proofroll.elements.mechanism.scene.control import Control
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling, check_drives
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.parts import Body, Force, Loop, Point, Spring
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact, Geometry, Pair, contacts_of
from proofroll.elements.mechanism.scene.signal import Formula, Held, Signal, Table

# Laws of impacts of several contacts at once, see Mechanism.impacts.
IN_ANY_ORDER, TOGETHER = "any order", "together"


class JointOrLoop(NamedTuple):
    """Connection of bodies a and b (b: a joint's child): places [m] and frames, as columns, in each body's axes.

    ``length``: of a loop that holds a distance [m].
    """

    name: str
    kind: str
    a: str
    position_a: Vector
    frame_a: Array
    b: str
    position_b: Vector
    frame_b: Array
    length: float = 0.0


@dataclass(frozen=True)
class Mechanism:
    """Bodies, their connections, what acts on them, and gravity.

    Attributes:
        bodies: in the order of the scene; arrays over bodies have this order.
        joints: sorted depth-first from the world, whatever order is given; q and v have this order.
        loops, springs, bushings, forces, points, geometries, pairs: in the order of the scene.
        gravity: acceleration in the world's axes, m/s².
        actuators: in the order of the scene; each drives a joint.
        couplings: pairs of joints that move together.
        control: sets targets of actuators at instants; None: nothing does.
        cells: its held signals while it runs, see :mod:`proofroll.elements.mechanism.dynamics.held_signals`.
        impacts: law of impacts of several contacts at once. "any order": one after the other in any order, whose
            outcomes must be the same; "together": Moreau's law for all of them.
        unmodelled: features of its source that no model here has, in a few words each; with any of them every route and
            engine refuses the mechanism.
    """

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    loops: tuple[Loop, ...] = ()
    springs: tuple[Spring, ...] = ()
    points: tuple[Point, ...] = ()
    gravity: Vector = (0.0, 0.0, -9.81)
    unmodelled: tuple[str, ...] = ()
    geometries: tuple[Geometry, ...] = ()
    pairs: tuple[Pair, ...] = ()
    actuators: tuple[Actuator, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    impacts: str = IN_ANY_ORDER
    forces: tuple[Force, ...] = ()
    control: Control | None = None
    cells: tuple[Held, ...] = ()
    bushings: tuple[Bushing, ...] = ()

    @property
    def held(self) -> tuple[float, ...]:
        """Present values of its held signals."""
        return tuple(cell.value for cell in self.cells)

    def __post_init__(self) -> None:
        kinds = ("bodies", "joints", "loops", "springs", "forces", "points", "geometries", "pairs", "actuators")
        for key in (*kinds, "couplings", "bushings"):
            checks.assign(self, **{key: tuple(getattr(self, key))})
            _check_unique(key, getattr(self, key))
        checks.assign(self, unmodelled=tuple(self.unmodelled))
        if self.impacts not in {IN_ANY_ORDER, TOGETHER}:
            raise InputError("impacts", self.impacts, f'give "{IN_ANY_ORDER}" or "{TOGETHER}"')
        _check_unique("loops", self.joints + self.loops)  # results name both alike
        names = sorted({WORLD, *(body.name for body in self.bodies)})
        for kind in ("joints", "loops", "springs", "bushings", "forces", "points", "geometries"):
            for item in getattr(self, kind):
                for key in ("parent", "child", "body_a", "body_b", "body", "reaction"):
                    field = f"{kind}.{item.name}.{key}"
                    require_known(field, getattr(item, key, WORLD), names, "there is no such body; choose from")
        checks.assign(self, joints=_depth_first(self.bodies, self.joints))
        check_drives(self.joints, self.actuators, self.couplings)
        if self.control is not None:
            self.control.check(self.actuators)
        checks.assign(self, gravity=checks.vector("gravity", self.gravity))
        _check_masses(self.bodies, self.joints, {name for item in self.couplings for name, _ in item.terms})
        for touching in (self.contacts, self.pairs):  # forces of all of these are named alike
            _check_unique("pairs", (*self.joints, *self.loops, *self.bushings, *touching))

    @property
    def together(self) -> bool:
        """True if impacts of several contacts at once follow Moreau's law."""
        return self.impacts == TOGETHER

    @cached_property
    def contacts(self) -> tuple[BodyContact, ...]:
        """Places where two bodies may touch; arrays over contacts have this order."""
        return contacts_of(self.geometries, self.pairs)

    @cached_property
    def body_index(self) -> dict[str, int]:
        """Index of each body in :attr:`bodies`; -1 for the world."""
        return {WORLD: -1} | {body.name: index for index, body in enumerate(self.bodies)}

    @cached_property
    def connections(self) -> tuple[JointOrLoop, ...]:
        """The joints, then the loops: arrays of forces and moments have this order."""
        return (
            *(
                JointOrLoop(
                    name=j.name,
                    kind=j.kind,
                    a=j.parent,
                    position_a=j.position,
                    frame_a=j.parent_frame,
                    b=j.child,
                    position_b=j.child_position,
                    frame_b=j.child_frame,
                )
                for j in self.joints
            ),
            *(
                JointOrLoop(
                    name=k.name,
                    kind=k.kind,
                    a=k.body_a,
                    position_a=k.position_a,
                    frame_a=k.frame_a,
                    b=k.body_b,
                    position_b=k.position_b,
                    frame_b=k.frame_b,
                    length=k.length,
                )
                for k in self.loops
            ),
        )

    @property
    def has_events(self) -> bool:
        """True if contacts, stops, dry friction or limits of efforts may change the mode of motion."""
        of_joints = any(joint.friction or joint.limits for joint in self.joints)
        return bool(self.contacts) or of_joints or any(item.limit is not None for item in self.actuators)

    @property
    def shares_cone(self) -> bool:
        """True if sliding and turning of a pair share a cone."""
        return any(pair.cone == "shared" for pair in self.pairs)

    @cached_property
    def conservative(self) -> bool:
        """True if nothing drives or dissipates."""
        if self.actuators or self.forces or self.prescribed:
            return False
        laws = [(j.damping, j.friction, j.torque, j.limits and j.restitution < 1) for j in self.joints]
        turning = any(pair.rolling_resistance or pair.spinning_friction for pair in self.pairs)
        lossy = turning or any(pair.friction or pair.restitution < 1 for pair in self.pairs)
        damped = any(spring.damping or spring.force for spring in self.springs)
        damped = damped or any(any(bushing.damping) for bushing in self.bushings)
        return not lossy and not damped and not any(any(law) for law in laws)

    @property
    def fastened(self) -> dict[str, list[Vector]]:
        """Points of each body, and of the world, that joints, loops, springs, bushings, forces or points have [m].

        In the frame of the body; the world comes last. A free joint attaches nothing.
        """
        places: dict[str, list[Vector]] = {name: [] for name in [*(body.name for body in self.bodies), WORLD]}
        for connection in self.connections:
            if connection.kind != JointKind.FREE:
                places[connection.a].append(connection.position_a)
                places[connection.b].append(connection.position_b)
        for link in self.links:
            places[link.body_a].append(link.position_a)
            places[link.body_b].append(link.position_b)
        for force in self.forces:
            if force.kind == "force":
                places[force.body].append(force.position)
        for point in self.points:
            places[point.body].append(point.position)
        return places

    @property
    def links(self) -> tuple[Spring | Bushing, ...]:
        """Springs, then bushings: what acts between a place of one body and one of another."""
        return (*self.springs, *self.bushings)

    @cached_property
    def followed(self) -> tuple[tuple[str, Vector], ...]:
        """Body and place on it [m] of the tracked points, or without any of the centres of mass."""
        tracked = tuple((point.body, point.position) for point in self.points)
        return tracked or tuple((body.name, body.com) for body in self.bodies)

    @cached_property
    def mass(self) -> float:
        """Mass of all bodies [kg]."""
        return sum(body.mass for body in self.bodies)

    def natural_sizes(self, length: float, speed: float) -> dict[str, float]:
        """Unit -> natural size, for this length [m] and speed [m/s].

        Force: the mechanism's weight or, if larger, the centripetal force on its mass.
        """
        force = self.mass * max(float(np.linalg.norm(self.gravity)), speed**2 / length)
        momentum, energy = self.mass * speed, force * length
        sizes = {"m": length, "m/s": speed, "N": force, "J": energy, "N m": energy}
        return sizes | {"N s": momentum, "N m s": momentum * length, "1": 1.0}

    @cached_property
    def nq(self) -> int:
        """Number of coordinates of the tree."""
        return sum(joint.nq for joint in self.joints)

    @cached_property
    def nv(self) -> int:
        """Number of velocities of the tree."""
        return sum(joint.nv for joint in self.joints)

    @cached_property
    def q_slices(self) -> tuple[slice, ...]:
        """Slice of each joint's coordinates in q."""
        return slices(joint.nq for joint in self.joints)

    @cached_property
    def v_slices(self) -> tuple[slice, ...]:
        """Slice of each joint's velocities in v."""
        return slices(joint.nv for joint in self.joints)

    @cached_property
    def joint_index(self) -> dict[str, int]:
        """Index of each joint in :attr:`joints`."""
        return {joint.name: number for number, joint in enumerate(self.joints)}

    @cached_property
    def prescribed(self) -> tuple[tuple[Joint, int, int], ...]:
        """Joints with a prescribed motion, each with its indices in q and v."""
        return tuple((joint, *self.place_of(joint.name)) for joint in self.joints if joint.motion is not None)

    @property
    def moved_by_tables(self) -> bool:
        """True if the prescribed motion of a joint is a table, a spline of many pieces."""
        return any(isinstance(joint.motion, Table) for joint, _, _ in self.prescribed)

    @cached_property
    def signals(self) -> tuple[Signal, ...]:
        """Drives of joints, targets of actuators, components of forces, prescribed motions."""
        of_joints = *(joint.torque for joint in self.joints), *(item.target for item in self.actuators)
        of_forces = (part for force in self.forces for part in force.value)
        return (*of_joints, *of_forces, *(joint.motion for joint, _, _ in self.prescribed if joint.motion is not None))

    @cached_property
    def kinks(self) -> dict[Hashable, list[str]]:
        """Laws with kinks, springs by their names and formulas of time themselves, and the functions of the kinks."""
        laws: dict[Hashable, list[str]] = {
            spring.name: spring.force.kinks for spring in self.springs if spring.force is not None
        }
        laws |= {signal: signal.kinks for signal in self.signals if isinstance(signal, Formula)}
        return {law: names for law, names in laws.items() if names}

    def place_of(self, joint: str) -> tuple[int, int]:
        """Indices in q and v of a joint with one coordinate."""
        number = self.joint_index[joint]
        return self.q_slices[number].start, self.v_slices[number].start

    def start(self) -> tuple[Array, Array]:
        """Coordinates (nq) and velocities (nv) of the tree at the start."""
        return (
            np.array([value for joint in self.joints for value in joint.q0]),
            np.array([value for joint in self.joints for value in joint.v0]),
        )


def _check_unique(kind: str, items: Iterable[Any]) -> None:
    seen = set()
    for item in items:
        if item.name in seen:
            raise InputError(f"{kind}.{item.name}.name", item.name, "this name is used twice; names must be unique")
        seen.add(item.name)


def _depth_first(bodies: Sequence[Body], joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """The joints, each after the joint of its parent and directly before those of its descendants.

    Some engines are silently wrong in another order (Pinocchio's crba).
    """
    holder: dict[str, Joint] = {}
    for joint in joints:
        if joint.child in holder:
            first_joint = holder[joint.child].name
            advice = (
                f"the body has two parents, through {first_joint} and {joint.name}; make one of these joints a loop"
            )
            raise InputError(f"joints.{joint.name}.child", joint.child, advice)
        holder[joint.child] = joint
    for body in bodies:
        if body.name not in holder:
            raise InputError(f"bodies.{body.name}", body.name, "no joint has this body as its child; add a free joint")
    children: dict[str, list[Joint]] = {}
    for joint in joints:
        children.setdefault(joint.parent, []).append(joint)
    ordered: list[Joint] = []
    waiting = children.get(WORLD, [])[::-1]
    while waiting:  # without recursion: chains are long
        joint = waiting.pop()
        ordered.append(joint)
        waiting += children.get(joint.child, [])[::-1]
    if len(ordered) < len(joints):
        lost = next(joint for joint in joints if joint not in ordered)
        advice = "the joints form a cycle that never reaches the world; make one of its joints a loop"
        raise InputError(f"joints.{lost.name}.parent", lost.parent, advice)
    return tuple(ordered)


def _check_masses(bodies: Sequence[Body], joints: Sequence[Joint], coupled: Collection[str]) -> None:
    """Raises InputError unless a joint moves a mass: its child, a body that this carries, or one through a coupling."""
    carried = {body.name: body.mass for body in bodies} | {WORLD: 0.0}
    for joint in reversed(joints):  # sorted: the children come last
        carried[joint.parent] += carried[joint.child]
        if not carried[joint.child] and joint.nv and not joint.armature and joint.name not in coupled:
            raise InputError(
                f"bodies.{joint.child}.mass", 0.0, "a body without mass can move here; give it one or fix it"
            )
