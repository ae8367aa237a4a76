"""Loads on bodies and targets of actuators at one time, for adapters that set both from outside their engine."""

import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion
from proofroll.elements.mechanism.dynamics.point_loads import applied_loads
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import value_at, varies


def loads_at(mechanism: Mechanism, t: float, p_WB: Array, R_WB: Array) -> tuple[Array, Array]:
    """Force [N] and moment about the body's origin [N m] on each body, world axes, (bodies, 3) each.

    They are those of the joints' drives and of applied forces, with their reactions on other bodies.

    Args:
        mechanism: with the drives and forces.
        t: time [s].
        p_WB: origins of the bodies [m], (bodies, 3).
        R_WB: rotations of the bodies, (bodies, 3, 3).
    """
    p, R, none = np.vstack([p_WB, np.zeros(3)]), np.concatenate([R_WB, np.eye(3)[None]]), np.zeros(0)
    force, moment = np.zeros((2, *p.shape))  # the last row: of the world
    for joint in mechanism.joints:
        if varies(joint.torque) or joint.torque:
            parent, child = mechanism.body_index[joint.parent], mechanism.body_index[joint.child]
            effort = value_at(joint.torque, t) * R[child] @ joint.child_frame[:, 2]
            place = p[child] + R[child] @ joint.child_position
            slides = joint.kind == JointKind.PRISMATIC
            for body, sign in ((child, 1.0), (parent, -1.0)):
                force[body] += sign * slides * effort
                moment[body] += sign * (cross(place - p[body], effort) if slides else effort)
    motion = BodyMotion(
        p_WB=p, R_WB=R, v_WB=none, w_WB=none, J=none, bias=none, p_joint=none, R_parent=none, q=none
    )  # loads of applied forces depend on poses alone
    for applied in mechanism.forces:
        for load in applied_loads(mechanism, applied, motion, t):
            force[load.body] += load.force
            moment[load.body] += load.moment + cross(load.arm, load.force)
    return force[:-1], moment[:-1]


def targets_at(mechanism: Mechanism, t: float) -> Array:
    """Targets of all actuators at a time [s], in the scene's order, (actuators,); in the unit of each."""
    return np.array([float(value_at(item.target, t)) for item in mechanism.actuators])
