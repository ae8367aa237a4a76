"""MuJoCo's mass matrix and bias forces in the velocities of a mechanism's tree."""

from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.joint import child_in_parent
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array, skews
from proofroll.engines.mujoco.running import mass_matrix
from proofroll.engines.mujoco.smooth import mechanism_model


def equation_matrices(mechanism: Mechanism, model: Any, data: Any) -> tuple[Array, Array, Array]:
    """M, h and g of M v̇ + h + g = τ, (nv, nv), (nv), (nv), at the state of ``data``.

    MuJoCo has its own order of velocities, and those of a free joint along the axes of the parent.
    """
    T, still = _velocities(mechanism, model)
    M, bias = mass_matrix(model, data), np.array(data.qfrc_bias)
    resting = mujoco.MjData(model)
    mujoco.mj_copyData(resting, model, data)
    resting.qvel[:] = 0.0
    mujoco.mj_fwdVelocity(model, resting)
    weights = np.array(resting.qfrc_bias)
    return T.T @ M @ T, T.T @ (bias - weights + M @ still), T.T @ weights


def _velocities(mechanism: Mechanism, model: Any) -> tuple[Array, Array]:
    """Derivative of MuJoCo's velocities by the tree's, (nv, nv), and their rate at constant velocities of the tree."""
    T, still = np.zeros((model.nv, mechanism.nv)), np.zeros(model.nv)
    q, v = mechanism.start()
    for joint, at_q, columns in zip(mechanism.joints, mechanism.q_slices, mechanism.v_slices, strict=True):
        parts = [model.joint(name) for name in mechanism_model.part_names(joint)]
        if not parts:
            continue
        dof = int(parts[0].dofadr[0])
        T[dof : dof + joint.nv, columns] = np.eye(joint.nv)
        if joint.kind != JointKind.FREE:
            continue
        R = child_in_parent(joint.kind, q[at_q])[1]
        arm = np.zeros(3)
        if len(parts) == 1:  # velocity of the origin of the body's frame in the world
            R = joint.parent_frame @ R
            arm = R @ joint.child_position
        linear, turning = R @ v[columns][:3], R @ v[columns][3:]
        T[dof : dof + 3, columns.start : columns.start + 3] = R
        T[dof : dof + 3, columns.start + 3 : columns.stop] = skews(arm[None])[0] @ R
        still[dof : dof + 3] = cross(turning, linear - cross(turning, arm))
    return T, still
