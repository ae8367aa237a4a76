"""Joints, loops and motors in Rapier's terms: a joint moves along or about x of its frame there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rapier3d
from scipy.spatial.transform import Rotation

from proofroll.adapter import Array, Joint, JointKind, Loop, Mechanism, Refused
from proofroll_rapier.poses import isometry
from proofroll_rapier.settings import HARD, RapierSettings

_MASKS = rapier3d.JointAxesMask
_LOCKED = {
    JointKind.FIXED: _MASKS.LOCKED_FIXED_AXES,
    JointKind.REVOLUTE: _MASKS.LOCKED_REVOLUTE_AXES,
    JointKind.PRISMATIC: _MASKS.LOCKED_PRISMATIC_AXES,
    JointKind.SPHERICAL: _MASKS.LOCKED_SPHERICAL_AXES,
    JointKind.PLANAR: _MASKS.LIN_X | _MASKS.ANG_Y | _MASKS.ANG_Z,
}
# Axis of the coordinate of a joint with one.
MOVES = {JointKind.REVOLUTE: rapier3d.JointAxis.ANG_X, JointKind.PRISMATIC: rapier3d.JointAxis.LIN_X}
# A force limit that is none; Rapier's own is the largest number of 24 bits.
_UNLIMITED = 3e38


def joint_data(joint: Joint, mechanism: Mechanism, settings: RapierSettings) -> Any:
    """Rapier's joint with its stops, and with its spring and damper as the one motor that an axis has.

    Raises:
        Refused: an axis would need two motors, or a spring is about three axes.
    """
    made = _holding(
        joint.kind,
        ((joint.position, joint.parent_frame), (joint.child_position, joint.child_frame)),
        settings,
    )
    if joint.limits:
        made = made.limits(MOVES[joint.kind], *joint.limits)
    if joint.stiffness or joint.damping:
        if joint.kind not in MOVES or any(item.joint == joint.name for item in mechanism.actuators):
            raise Refused(f"{joint.name}: Rapier has one motor for each axis, for a spring or for a drive")
        axis = MOVES[joint.kind]
        made = made.motor(axis, joint.rest, 0.0, joint.stiffness, joint.damping)
        made = made.motor_model(axis, rapier3d.MotorModel.FORCE_BASED)
    return made.build()


def loop_data(loop: Loop, settings: RapierSettings) -> Any:
    """Rapier's joint that closes a loop."""
    ends = ((loop.position_a, loop.frame_a), (loop.position_b, loop.frame_b))
    return _holding(loop.kind, ends, settings).build()


def _holding(kind: str, ends: Sequence[tuple[Array, Array]], settings: RapierSettings) -> Any:
    """Builder of a joint between two frames whose z is the axis."""
    parent, child = (isometry(place, np.roll(frame, 1, axis=1)) for place, frame in ends)
    made = rapier3d.GenericJointBuilder(_LOCKED[JointKind(kind)]).local_frame1(parent).local_frame2(child)
    return made.softness(rapier3d.SpringCoefficients(HARD, 1.0)) if settings.preset == "matched" else made


class Motors:
    """Servos of joints, whose targets are set anew.

    Args:
        mechanism: with the actuators.
        world: Rapier's world.
        handles: name of a joint -> its handle there.
        settings: of the run.

    Raises:
        Refused: an actuator is not one of position or velocity at an axis.
    """

    def __init__(self, mechanism: Mechanism, world: Any, handles: dict[str, Any], settings: RapierSettings) -> None:
        self._world, self._handles, self._settings = world, handles, settings
        joints = {joint.name: joint for joint in mechanism.joints}
        self._driven = [(item, joints[item.joint]) for item in mechanism.actuators]
        for item, joint in self._driven:
            if item.kind not in {"position", "velocity"}:
                raise Refused(f"{item.name}: Rapier's motors follow a position or a velocity, not a torque")
            if joint.kind not in MOVES:
                raise Refused(f"{item.name}: this adapter sets motors of revolute and prismatic joints alone")

    def set_targets(self, targets: Array) -> None:
        """Targets of the actuators from now on, in the scene's order and units."""
        for (item, joint), target in zip(self._driven, targets.tolist(), strict=True):
            gear = item.gear
            follows = item.kind == "position"
            self._set_motor(
                joint,
                place=target / gear if follows else 0.0,
                speed=0.0 if follows else target / gear,
                stiffness=gear * gear * item.kp if follows else 0.0,
                damping=gear * gear * item.kd,
                limit=_UNLIMITED if item.limit is None else item.limit,
            )

    def _set_motor(
        self, joint: Joint, place: float, speed: float, stiffness: float, damping: float, limit: float
    ) -> None:
        axis, handle = MOVES[joint.kind], self._handles[joint.name]
        if self._settings.formulation == "multibody":
            found, link = self._world.multibody_joints.get(handle)
            found.set_link_motor_model(link, axis, rapier3d.MotorModel.FORCE_BASED)
            found.set_link_motor(link, axis, place, speed, stiffness, damping)
            found.set_link_motor_max_force(link, axis, limit)
            return
        held = self._world.impulse_joints.get(handle)
        changed = held.data  # a copy, which is given back
        changed.set_motor_model(axis, rapier3d.MotorModel.FORCE_BASED)
        changed.set_motor(axis, place, speed, stiffness, damping)
        changed.set_motor_max_force(axis, limit)
        held.data = changed


def start_reduced(mechanism: Mechanism, world: Any, handles: dict[str, Any], start: Any, preset: str) -> None:
    """Sets coordinates, velocities and armature of multibodies, which begin at zero, whatever their bodies' poses are.

    Args:
        mechanism: with the joints.
        world: Rapier's world.
        handles: name of a joint -> its handle there.
        start: of the scene's element.
        preset: ``matched`` takes off the damping of 0.1 N m s/rad that Rapier gives to all coordinates.
    """
    trees: dict[Any, tuple[Any, Array]] = {}
    for joint in mechanism.joints:
        if joint.name not in handles:
            continue
        tree, link = world.multibody_joints.get(handles[joint.name])
        tree.forward_kinematics(world.rigid_bodies)  # only then the six coordinates of a fixed root are gone
        _, values = trees.setdefault(tree.root_handle, (tree, np.zeros((3, tree.ndofs))))
        first, count = tree.get_link(link).assembly_id, tree.get_link(link).ndofs
        if count == 1:
            values[:, first] = joint.q0[0], joint.v0[0], joint.armature
        elif joint.kind == JointKind.SPHERICAL:
            values[:2, first : first + count] = _turned(mechanism, joint, start)
    for tree, (places, speeds, armature) in trees.values():
        tree.apply_displacements(places.tolist())
        tree.forward_kinematics(world.rigid_bodies)
        tree.set_generalized_velocity(speeds.tolist())
        tree.set_armature(armature.tolist())
        if preset == "matched":
            tree.set_damping([0.0] * tree.ndofs)
        tree.update_rigid_bodies(world.rigid_bodies, True)


def _turned(mechanism: Mechanism, joint: Joint, start: Any) -> tuple[Array, Array]:
    """Rotation vector of a ball joint [rad], and its angular velocity [rad/s], in axes of its frame on the parent."""
    parent, child = (mechanism.body_index[name] for name in (joint.parent, joint.child))
    A = start.R_WB[0, parent] @ np.roll(joint.parent_frame, 1, axis=1)
    B = start.R_WB[0, child] @ np.roll(joint.child_frame, 1, axis=1)
    spin = start.w_WB[0, child] - (start.w_WB[0, parent] if parent >= 0 else 0)
    return Rotation.from_matrix(A.T @ B).as_rotvec(), A.T @ spin
