"""Joints that move no inertia of their own: only loops or couplings make them move a mass."""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism.dynamics.kinematics import Tree
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import skews

SINGULAR = 1e-12  # least eigenvalue of a mass matrix scaled to a diagonal of ones; below, it counts as singular


def lacks_inertia(mechanism: Mechanism) -> bool:
    """True if the tree alone, without its loops and couplings, can move at the start without kinetic energy."""
    light = any(not body.mass or not np.any(body.inertia) for body in mechanism.bodies)
    if not light or not (mechanism.loops or mechanism.couplings):
        return False
    motion = Tree(mechanism).at(*mechanism.start())
    rows = [np.diag(np.sqrt([joint.armature for joint in mechanism.joints for _ in range(joint.nv)]))]
    for number, body in enumerate(mechanism.bodies):
        R, J = motion.R_WB[number], motion.J[number]
        arm = (R @ np.array(body.com))[None]
        moments, axes = np.linalg.eigh(np.array(body.inertia))
        rows.append(np.sqrt(body.mass) * (J[:3] - skews(arm)[0] @ J[3:]))
        rows.append(np.sqrt(np.maximum(moments, 0.0))[:, None] * ((R @ axes).T @ J[3:]))
    speeds = np.concatenate(rows)
    sizes = np.linalg.norm(speeds, axis=0)
    values = np.linalg.svd(speeds / np.where(sizes > 0, sizes, 1.0), compute_uv=False)
    return bool(values.min(initial=1.0) ** 2 < SINGULAR)
