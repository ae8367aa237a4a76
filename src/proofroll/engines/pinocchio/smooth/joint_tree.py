"""Mechanism as a pin.Model: its tree of joints, a frame at every attachment, and its forces.

Joints are added depth-first, the order of a mechanism's joints; in any other order Pinocchio's crba silently gives a
wrong mass matrix. A joint's frame is frame B on the child; bodies held by fixed joints are appended to the joint that
carries them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Joint, Loop, Mechanism, Spring
from proofroll.elements.mechanism.dynamics.analysis import lacks_inertia
from proofroll.elements.mechanism.run.capabilities import ALL_JOINTS, ALL_LOOPS, FORCES, MechanismCapability
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION, JointKind
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import value_at, varies

_OF_JOINTS = {
    MechanismCapability[name] for name in (
        "REDUNDANT", "ARMATURE", "ACTUATORS", "SATURATION", "SIGNALS", "HELD", "COUPLINGS", "COUPLINGS_OF_MANY",
        "MASSLESS", "MOTIONS",
    )
}  # fmt: skip
PROVIDES: frozenset[str] = ALL_JOINTS | ALL_LOOPS | FORCES | _OF_JOINTS
LACKING: Mapping[str, str] = {
    MechanismCapability[name]: "these equations have no law that switches"
    for name in ("JOINT_FRICTION", "STOPS", "REBOUNDS")
}
_X, _Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
# Column of the axis of rotation or translation among a joint's own velocities.
AXIS_COLUMN = {
    JointKind.REVOLUTE: 0,
    JointKind.PRISMATIC: 0,
    JointKind.CYLINDRICAL: 1,
    JointKind.UNIVERSAL: 0,
    JointKind.PLANAR: 2,
}


class JointTree:
    """Pinocchio's model of a mechanism, and the mechanism's forces.

    Attributes:
        model: pin.Model.
        q0, v0: configuration and velocity at time 0.
        joint: index of Pinocchio's joint for each joint of the mechanism; for a fixed one, of the carrying joint.
        body, at_joint: indices of Pinocchio's frames of the bodies, and of the joints on their children.
        loops: frames at both ends of each loop.
        springs: each spring with the frames at both ends.
        drive, damping: of each velocity, shape (nv,).
        sprung: stiffness, rest, and slices of configuration and velocity, of each joint with a spring.
        varies: True if a drive or a target changes in time.
        now: time at which drives and targets are evaluated [s].
        own_velocities: True if velocities are those of the mechanism, with those of free bodies along their own axes.
        closed: True if there are loops, couplings or prescribed motions.
        light: True if only loops or couplings give some joints inertia.
        geared: Jacobian of couplings, then of prescribed motions, for joint velocities, (couplings + motions, nv).
    """

    def __init__(self, mechanism: Mechanism, *, apart: bool = False) -> None:
        """Builds the model; with ``apart`` a free body is a translation in world axes and a rotation.

        In a free-flyer joint a step of semi-implicit Euler multiplies velocities by the square root of 1 + (ω dt)².
        """
        self.mechanism, self._apart = mechanism, apart
        self.model: Any = pin.Model()
        self.model.gravity.linear = np.array(mechanism.gravity)
        self.joint: list[int] = []
        self.at_joint: list[int] = []
        carried = {WORLD: (0, pin.SE3.Identity())}  # body -> joint that carries it, pose of its frame in that joint
        data = {body.name: body for body in mechanism.bodies}
        frames: dict[str, int] = {}
        for joint in mechanism.joints:
            parent, pose = carried[joint.parent]
            place = pose * pin.SE3(joint.parent_frame, np.array(joint.position))
            back = pin.SE3(joint.child_frame, np.array(joint.child_position)).inverse()
            if joint.kind == JointKind.FIXED:
                index, place = parent, place * back
            else:
                index, place = self.model.addJoint(parent, self._joint_model(joint), place, joint.name), back
            carried[joint.child] = index, place
            body = data[joint.child]
            inertia = pin.Inertia(body.mass, np.array(body.com), np.array(body.inertia))
            frames[body.name] = self._frame(f"body {body.name}", index, place, inertia)
            on_child = place * pin.SE3(joint.child_frame, np.array(joint.child_position))
            self.at_joint.append(self._frame(f"joint {joint.name}", index, on_child))
            self.joint.append(index)
        self.body = [frames[body.name] for body in mechanism.bodies]
        self.loops = [self._ends(carried, loop, loop.frame_a, loop.frame_b) for loop in mechanism.loops]
        self.springs = [(spring, *self._ends(carried, spring, np.eye(3), np.eye(3))) for spring in mechanism.springs]
        self._bushings = [(item, *self._ends(carried, item, np.eye(3), np.eye(3))) for item in mechanism.bushings]
        frames[WORLD] = 0
        self._forces = [(force, frames[force.body], frames[force.reaction]) for force in mechanism.forces]
        self.pushed = bool(self.springs or self._bushings or self._forces)
        self.own_velocities = not (apart and any(joint.kind == JointKind.FREE for joint in mechanism.joints))
        self.q0, self.v0 = self._start()
        self._laws()

    def _frame(self, name: str, joint: int, place: Any, inertia: Any = None) -> int:
        carried = inertia if inertia is not None else pin.Inertia.Zero()
        frame = pin.Frame(name, joint, 0, place, pin.FrameType.OP_FRAME, carried)
        return int(self.model.addFrame(frame, inertia is not None))

    def _ends(self, carried: Any, item: Loop | Spring | Bushing, A: Array, B: Array) -> tuple[int, int]:
        """Frames at both ends of a loop, spring or bushing, with axes A and B in the bodies."""
        (on_a, at_a), (on_b, at_b) = carried[item.body_a], carried[item.body_b]
        return (
            self._frame(f"{item.name} a", on_a, at_a * pin.SE3(A, np.array(item.position_a))),
            self._frame(f"{item.name} b", on_b, at_b * pin.SE3(B, np.array(item.position_b))),
        )

    def _joint_model(self, joint: Joint) -> Any:
        if joint.kind == JointKind.PLANAR:  # pin.JointModelPlanar has cosine and sine, and velocities in the child
            return _composite(pin.JointModelPX(), pin.JointModelPY(), pin.JointModelRZ())
        if joint.kind == JointKind.CYLINDRICAL:
            return _composite(pin.JointModelPZ(), pin.JointModelRZ())
        if joint.kind == JointKind.FREE and self._apart:
            return _composite(pin.JointModelTranslation(), pin.JointModelSpherical())
        return {
            JointKind.REVOLUTE: pin.JointModelRZ,
            JointKind.PRISMATIC: pin.JointModelPZ,
            JointKind.UNIVERSAL: lambda: pin.JointModelUniversal(_Z, _X),
            JointKind.SPHERICAL: pin.JointModelSpherical,
            JointKind.FREE: pin.JointModelFreeFlyer,
        }[joint.kind]()

    def _start(self) -> tuple[Array, Array]:
        q, v = self.mechanism.start()
        slices = zip(self.mechanism.joints, self.mechanism.q_slices, self.mechanism.v_slices, strict=True)
        for joint, at_q, at_v in slices:
            if joint.kind in WITH_QUATERNION:  # Pinocchio writes the scalar last
                q[at_q.stop - 4 : at_q.stop] = np.roll(q[at_q.stop - 4 : at_q.stop], -1)
            if joint.kind == JointKind.FREE and self._apart:
                linear = slice(at_v.start, at_v.start + 3)
                v[linear] = pin.Quaternion(q[at_q.stop - 4 : at_q.stop]).matrix() @ v[linear]
        return q, v

    def _laws(self) -> None:
        joints = self.mechanism.joints
        by_velocity = [joint for joint in joints for _ in range(joint.nv)]
        self.model.armature = np.array([joint.armature for joint in by_velocity])
        self.drive = np.array([joint.constant_drive for joint in by_velocity])
        self.damping = np.array([joint.damping for joint in by_velocity])
        sprung = zip(joints, self.mechanism.q_slices, self.mechanism.v_slices, strict=True)
        self.sprung = [(joint.stiffness, joint.rest, at_q, at_v) for joint, at_q, at_v in sprung if joint.stiffness]
        self._timed = [
            (joint.torque, columns)
            for joint, columns in zip(joints, self.mechanism.v_slices, strict=True)
            if varies(joint.torque)
        ]
        self._actuators = [(item.law(), *self.mechanism.place_of(item.joint)) for item in self.mechanism.actuators]
        self.varies, self.now = any(map(varies, self.mechanism.signals)), 0.0
        self._constant = not (self.sprung or self.damping.any() or self._timed or self._actuators)
        couplings = self.mechanism.couplings
        moving = self.mechanism.prescribed
        self.closed = bool(self.mechanism.loops or couplings or moving)
        self.light = lacks_inertia(self.mechanism)
        self.geared = np.zeros((len(couplings) + len(moving), self.model.nv))
        self._geared_q = np.zeros((len(couplings) + len(moving), self.model.nq))
        for number, coupling in enumerate(couplings):
            for joint, factor in coupling.terms:
                at_q, at_v = self.mechanism.place_of(joint)
                self._geared_q[number, at_q] = self.geared[number, at_v] = factor
        for number, (_, at_q, at_v) in enumerate(moving, len(couplings)):
            self._geared_q[number, at_q] = self.geared[number, at_v] = 1.0
        self._still = [(coupling.place, 0.0, 0.0) for coupling in couplings]
        self._motions = [joint.motion for joint, _, _ in moving if joint.motion is not None]

    def apart(self, q: Array) -> tuple[Array, Array, Array]:
        """Residual of each coupling and motion, the rate that it prescribes, and minus the acceleration, rad or m."""
        aims = np.array([*self._still, *(moved(signal, self.now) for signal in self._motions)])
        return np.asarray(self._geared_q @ q - aims[:, 0]), aims[:, 1], -aims[:, 2]

    def drives(self, q: Array, v: Array) -> Array:
        """Generalised forces of joints' springs, dampers, drives and actuators, shape (nv,); read-only."""
        if self._constant:
            return self.drive
        tau = self.drive - self.damping * v
        for stiffness, rest, at_q, at_v in self.sprung:
            tau[at_v] -= stiffness * (q[at_q] - rest)
        for signal, at_v in self._timed:
            tau[at_v] += value_at(signal, self.now)
        if self._actuators:
            np.add.at(tau, [column for _, _, column in self._actuators], self.efforts(q, v))
        return tau

    def efforts(self, q: Array, v: Array) -> Array:
        """Efforts of the actuators, N or N m, (actuators,)."""
        return np.array([law(self.now, float(q[at_q]), float(v[at_v])) for law, at_q, at_v in self._actuators])

    def pulls(self, data: Any) -> Any:
        """Forces of springs, bushings and applied forces on Pinocchio's joints, in their axes.

        Positions and velocities come from ``data``.
        """
        forces = pin.StdVec_Force()
        for _ in range(self.model.njoints):
            forces.append(pin.Force.Zero())
        for spring, a, b in self.springs:
            between = data.oMf[b].translation - data.oMf[a].translation
            length = float(np.sqrt(between @ between))
            direction = between / length
            pull = spring.stiffness * (length - spring.length)
            if spring.damping or spring.force:
                rate = self.velocity(data, b).linear - self.velocity(data, a).linear
                pull += spring.damping * (direction @ rate)
                if spring.force is not None:
                    pull += spring.force.pull(length, float(direction @ rate))
            self.put(forces, data, a, data.oMf[a].translation, pull * direction)
            self.put(forces, data, b, data.oMf[b].translation, -pull * direction)
        for bushing, a, b in self._bushings:
            pose_a, pose_b = data.oMf[a], data.oMf[b]
            moving_a, moving_b = self.velocity(data, a), self.velocity(data, b)
            force, moment = bushing.load(
                pose_a.rotation,
                pose_b.rotation,
                pose_b.translation - pose_a.translation,
                moving_b.linear - moving_a.linear,
                moving_a.angular,
                moving_b.angular,
            )
            self.put(forces, data, b, pose_b.translation, force, moment)
            self.put(forces, data, a, pose_b.translation, -force, -moment)
        for applied, body, reaction in self._forces:
            pose, load = data.oMf[body], np.array(applied.at(self.now), dtype=float)
            load = pose.rotation @ load if applied.frame == "body" else load
            place = pose.translation + pose.rotation @ applied.position
            none = np.zeros(3)
            force, moment = (load, none) if applied.kind == "force" else (none, load)
            self.put(forces, data, body, place, force, moment)
            self.put(forces, data, reaction, place, -force, -moment)
        return forces

    def velocity(self, data: Any, frame: int) -> Any:
        """Linear and angular velocity of a frame's origin, in world axes."""
        return pin.getFrameVelocity(self.model, data, frame, pin.LOCAL_WORLD_ALIGNED)

    def put(self, forces: Any, data: Any, frame: int, place: Array, force: Array, torque: Array | None = None) -> None:
        """Adds to ``forces``, in place, a world-frame force and moment on the body that carries ``frame``.

        They act at the world point ``place`` [m]; ``force`` [N], ``torque`` [N m].
        """
        joint = self.model.frames[frame].parentJoint
        placement = data.oMi[joint].inverse() * pin.SE3(np.eye(3), place)
        forces[joint] = forces[joint] + placement.act(pin.Force(force, np.zeros(3) if torque is None else torque))


def _composite(joint_1: Any, *others: Any) -> Any:
    composite = pin.JointModelComposite(joint_1)
    for joint in others:
        composite.addJoint(joint)
    return composite


def require_tangent_map() -> None:
    """Refuses versions of Pinocchio without rates of quaternions.

    Raises:
        Refused: ``tangentMap`` is missing.
    """
    if not hasattr(pin, "tangentMap"):
        raise Refused(f"the rates of quaternions need tangentMap of pinocchio 4.0, and this is {pin.__version__}")
