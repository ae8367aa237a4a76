"""Applied forces of a mechanism except its weight: springs between points, and force laws of joints."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism import Joint, Mechanism
from proofroll.elements.mechanism.dynamics.switches import switched_joints
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import value_at, varies
from proofroll.engines.projection.smooth.connections import SKEW, Bodies, Ends


class _Law(NamedTuple):
    """Spring, damper and drive of one coordinate of a joint.

    ``axis``: z (of A), x (of B), or slide (along z of A). ``push``, a function of time, coordinate and rate, replaces
    them.
    """

    connection: int
    axis: str
    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0
    drive: float = 0.0
    push: Callable[[float, float, float], float] | None = None


class Applied:
    """Forces on the bodies except weight and reactions.

    Attributes:
        of_points: True if there are springs between points, bushings or applied forces.
        laws: True if joints have force laws.
        now: time at which drives and targets are evaluated [s].
        modes: mode of each effort with a limit, by the index of the actuator; an effort without a mode is clamped by
            its size.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        index, count = mechanism.body_index, len(mechanism.bodies)
        self._laws = [law for number, joint in enumerate(mechanism.joints) for law in _laws(number, joint)]
        number = mechanism.joint_index
        self._actuator_laws = [
            self._actuator_law(k, actuator, number[actuator.joint], mechanism.joints[number[actuator.joint]])
            for k, actuator in enumerate(mechanism.actuators)
        ]
        self._limited = [k for k, actuator in enumerate(mechanism.actuators) if actuator.limit is not None]
        self._actuators = mechanism.actuators
        self.modes: Mapping[int, str] = {}
        self._laws += self._actuator_laws
        self.now = 0.0
        sprung = [law for law in self._laws if (law.stiffness or law.push) and law.axis != "slide"]
        start = ((law, mechanism.joints[law.connection].q0) for law in sprung)
        self._angles = {law: q0[1 if law.axis == "x" else 0] for law, q0 in start}
        self._balls = [
            (n, joint.damping)
            for n, joint in enumerate(mechanism.joints)
            if joint.kind == JointKind.SPHERICAL and joint.damping
        ]
        self.laws = bool(self._laws or self._balls)
        # coordinates to evaluate, without a force law
        watched = {joint.number for joint in switched_joints(mechanism)}
        watched |= {number[name] for item in mechanism.couplings for name, _ in item.terms}
        watched |= {number[joint.name] for joint, _, _ in mechanism.prescribed}
        axes = {k: "slide" if mechanism.joints[k].kind == JointKind.PRISMATIC else "z" for k in sorted(watched)}
        self._watched = {k: _Law(k, axis) for k, axis in axes.items()}
        turning = [law for law in self._watched.values() if law.axis != "slide"]
        self._angles |= {law: mechanism.joints[law.connection].q0[0] for law in turning}
        com = np.array([*(body.com for body in mechanism.bodies), (0.0, 0.0, 0.0)])
        ends = [
            ((a, np.append(link.position_a - com[a], 1.0)), (b, np.append(link.position_b - com[b], 1.0)))
            for link in mechanism.links
            for a, b in [(index[link.body_a] % (count + 1), index[link.body_b] % (count + 1))]
        ]
        count = len(mechanism.springs)
        self._springs = [(spring, *both) for spring, both in zip(mechanism.springs, ends, strict=False)]
        self._bushings = [(bushing, *both) for bushing, both in zip(mechanism.bushings, ends[count:], strict=True)]
        self._forces = [
            (force, index[force.body], np.append(force.position - com[index[force.body]], 1.0), index[force.reaction])
            for force in mechanism.forces
        ]
        self.of_points = bool(self._springs or self._bushings or self._forces)

    def pulls(self, bodies: Bodies) -> Array:
        """Loads of springs, bushings and applied forces on bodies, (bodies, 4, 4): matrices f pᵀ of a force f at p."""
        forces = np.zeros((len(bodies.pose), 4, 4), dtype=bodies.pose.dtype)
        for spring, (a, at_a), (b, at_b) in self._springs:
            place_a, place_b = bodies.pose[a] @ at_a, bodies.pose[b] @ at_b
            between = place_b - place_a
            length = (between @ between) ** 0.5
            pull = spring.stiffness * (length - spring.length)
            if spring.damping or spring.force:
                rate = between @ (bodies.twist[b] @ place_b - bodies.twist[a] @ place_a) / length
                pull = spring.pull(length, rate)
            force = pull / length * between
            forces[a] += np.outer(force, place_a)
            forces[b] -= np.outer(force, place_b)
        for bushing, (a, at_a), (b, at_b) in self._bushings:
            place_a, place_b = bodies.pose[a] @ at_a, bodies.pose[b] @ at_b
            slide = (bodies.twist[b] @ place_b - bodies.twist[a] @ place_a)[:3]
            R_a, R_b = bodies.pose[a][:3, :3], bodies.pose[b][:3, :3]
            w_a, w_b = (0.5 * bodies.twist[k][:3, :3].ravel() @ SKEW.T for k in (a, b))
            force, moment = bushing.load(R_a, R_b, (place_b - place_a)[:3], slide, w_a, w_b)
            acts = np.outer(np.append(force, 0.0), place_b)
            acts[:3, :3] += 0.5 * np.cross(np.eye(3), moment)
            forces[b] += acts
            forces[a] -= acts
        for applied, body, place, reaction in self._forces:
            load = np.array(applied.at(self.now), dtype=float)
            load = bodies.pose[body][:3, :3] @ load if applied.frame == "body" else load
            if applied.kind == "force":
                acts = np.outer(np.append(load, 0.0), bodies.pose[body] @ place)
            else:
                acts = np.zeros((4, 4), dtype=forces.dtype)
                acts[:3, :3] = 0.5 * np.cross(np.eye(3), load)
            forces[body] += acts
            forces[reaction] -= acts
        return forces[:-1]

    def of_joints(self, ends: Ends) -> tuple[Array, Array]:
        """Forces and moments of the joints' force laws on body b at its point, world axes, (connections, 3) each."""
        force, torque = np.zeros_like(ends.d), np.zeros_like(ends.d)
        for law in self._laws:
            on = force if law.axis == "slide" else torque
            on[law.connection] += self._size(law, ends) * _direction(law, ends)
        for c, damping in self._balls:
            torque[c] -= damping * 0.5 * ends.relative[c, :3, :3].ravel() @ SKEW.T
        return force, torque

    def efforts(self, ends: Ends) -> Array:
        """Efforts of the actuators, N or N m, (actuators,)."""
        return np.array([self._size(law, ends) for law in self._actuator_laws])

    def _size(self, law: _Law, ends: Ends) -> float:
        if law.push is not None:
            return law.push(self.now, self._coordinate(law, ends), self._rate(law, ends))
        size = law.drive - law.damping * self._rate(law, ends)
        return size - law.stiffness * (self._coordinate(law, ends) - law.rest) if law.stiffness else size

    def watched(self, ends: Ends) -> dict[int, tuple[float, float]]:
        """Coordinate and velocity of each joint with dry friction, stops or a coupling, by its index."""
        return {k: (self._coordinate(law, ends), self._rate(law, ends)) for k, law in self._watched.items()}

    def along(self, joints: Sequence[int], ends: Ends) -> tuple[Array, Array]:
        """Forces and moments on body b at its point of unit forces along coordinates of joints, (joints, 3) each."""
        laws = [self._watched[k] for k in joints]
        ways, slides = np.array([_direction(law, ends) for law in laws]), [[law.axis == "slide"] for law in laws]
        return np.where(slides, ways, 0.0), np.where(slides, 0.0, ways)

    def wanted(self, ends: Ends) -> list[float]:
        """Efforts that the actuators with a limit would apply without it, N or N m."""
        pairs = ((self._actuators[k], self._actuator_laws[k]) for k in self._limited)
        return [
            float(actuator.wanted(self.now, self._coordinate(law, ends), self._rate(law, ends)))
            for actuator, law in pairs
        ]

    def _actuator_law(self, k: int, actuator: Actuator, number: int, joint: Joint) -> _Law:
        """Force law of an actuator at its joint: a function of t, q and v if it is limited or varies with time.

        Otherwise a linear spring, a damper and a constant drive.
        """
        n, target = actuator.gear, actuator.target
        axis = "slide" if joint.kind == JointKind.PRISMATIC else "z"
        if actuator.limit is not None or not isinstance(target, float):
            push = lambda t, q, v: actuator.effort(t, q, v, self.modes.get(k))  # noqa: E731 -- closes over its number
            return _Law(number, axis, push=push)
        gain = {"torque": 1.0, "velocity": actuator.kd, "position": actuator.kp}[actuator.kind]
        return _Law(
            connection=number,
            axis=axis,
            stiffness=n * n * actuator.kp,
            rest=0.0,
            damping=n * n * actuator.kd,
            drive=n * gain * target,
        )

    @staticmethod
    def _rate(law: _Law, ends: Ends) -> float:
        c = law.connection
        w = 0.5 * ends.relative[c, :3, :3].ravel() @ SKEW.T
        rate: float = _direction(law, ends) @ (ends.e[c] if law.axis == "slide" else w)
        return rate

    def _coordinate(self, law: _Law, ends: Ends) -> float:
        """Angle [rad], on the branch nearest to the last accepted one, or distance [m]."""
        A, B = ends.A[law.connection], ends.B[law.connection]
        if law.axis == "slide":
            slide: float = A[:, 2] @ ends.d[law.connection]
            return slide
        if law.axis == "z":
            angle = math.atan2(B[:, 0] @ A[:, 1], B[:, 0] @ A[:, 0])
        else:
            angle = math.atan2(A[:, 2] @ B[:, 1], A[:, 2] @ B[:, 2])
        return angle + math.tau * round((self._angles[law] - angle) / math.tau)

    @property
    def remembers(self) -> bool:
        """True if forces depend on the number of turns of a joint."""
        return bool(self._angles)

    def accept(self, ends: Ends) -> None:
        """Stores the angles of springs, so that they may exceed a turn."""
        for law in self._angles:
            self._angles[law] = self._coordinate(law, ends)


def _direction(law: _Law, ends: Ends) -> Array:
    return ends.B[law.connection, :, 0] if law.axis == "x" else ends.A[law.connection, :, 2]


def _laws(number: int, joint: Joint) -> list[_Law]:
    if not (joint.stiffness or joint.damping or joint.torque) or joint.kind == JointKind.SPHERICAL:
        return []
    axes = {JointKind.REVOLUTE: ("z",), JointKind.PRISMATIC: ("slide",), JointKind.UNIVERSAL: ("z", "x")}[joint.kind]
    laws_of_joint = [
        _Law(
            connection=number,
            axis=axis,
            stiffness=joint.stiffness,
            rest=joint.rest,
            damping=joint.damping,
            drive=joint.constant_drive,
        )
        for axis in axes
    ]
    if varies(joint.torque):  # one axis has it
        laws_of_joint.append(_Law(number, axes[0], push=lambda t, _q, _v: float(value_at(joint.torque, t))))
    return laws_of_joint
