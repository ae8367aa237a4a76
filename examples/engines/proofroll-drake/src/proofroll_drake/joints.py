"""Joints of a mechanism in Drake, and their initial state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    PlanarJoint,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    UniversalJoint,
    WeldJoint,
)

from proofroll.adapter import Joint

_Z = [0.0, 0.0, 1.0]
# Drake's universal joint turns about x of its frame on the parent, then about y of that on the child; ours about z, x.
_TURNED = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


def connect(plant: Any, bodies: Mapping[str, Any], joint: Joint) -> Any:
    """Adds a joint, and its frames on both bodies, to a plant; returns Drake's joint."""
    turn = _TURNED if joint.kind == "universal" else np.eye(3)
    ends = []
    for what, body, R, p in (
        ("parent", joint.parent, joint.parent_frame, joint.position),
        ("child", joint.child, joint.child_frame, joint.child_position),
    ):
        pose = RigidTransform(RotationMatrix(R @ turn), p)
        ends.append(plant.AddFrame(FixedOffsetFrame(f"{joint.name} {what}", bodies[body].body_frame(), pose)))
    return plant.AddJoint(_made(joint, *ends))


def _made(joint: Joint, on_parent: Any, on_child: Any) -> Any:
    name, damping = joint.name, joint.damping
    if joint.kind == "fixed":
        return WeldJoint(name, on_parent, on_child, RigidTransform())
    if joint.kind == "free":
        return QuaternionFloatingJoint(name, on_parent, on_child)
    if joint.kind in {"revolute", "prismatic"}:
        kind = RevoluteJoint if joint.kind == "revolute" else PrismaticJoint
        return kind(name, on_parent, on_child, _Z, damping=damping)
    if joint.kind == "planar":
        return PlanarJoint(name, on_parent, on_child)
    kind = UniversalJoint if joint.kind == "universal" else BallRpyJoint
    return kind(name, on_parent, on_child, damping=damping)


def start(plant: Any, context: Any, joint: Joint, built: Any) -> None:
    """Sets the initial state of a joint; Drake's velocities of free and ball joints are along the parent's axes."""
    q, v = np.array(joint.q0), np.array(joint.v0)
    if joint.kind in {"spherical", "free"}:
        R = RotationMatrix(Quaternion(q[-4:]))
        v = np.concatenate([R.matrix() @ part for part in v.reshape(-1, 3)])
        if joint.kind == "free":
            built.SetPose(context, RigidTransform(R, q[:3]))
            built.set_angular_velocity(context, v[3:])
            built.set_translational_velocity(context, v[:3])
        else:
            built.set_angles(context, RollPitchYaw(R).vector())
            built.set_angular_velocity(context, v)
    elif joint.nv:
        whole = np.array(plant.GetPositionsAndVelocities(context))
        whole[built.position_start() :][: joint.nq] = q
        whole[plant.num_positions() + built.velocity_start() :][: joint.nv] = v
        plant.SetPositionsAndVelocities(context, whole)
