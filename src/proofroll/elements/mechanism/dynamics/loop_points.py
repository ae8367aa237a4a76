"""Points that close a loop, for engines whose only constraints hold two points together."""

import numpy as np

from proofroll.elements.mechanism.dynamics.kinematics import Tree
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, IN_PLANE, JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Loop
from proofroll.elements.mechanism.scene.rotations import Array

# Distance of the two points on the axis of a revolute loop, relative to the mechanism's size.
_APART = 0.3
_PARALLEL = 1e-9  # round-off of directions
# Kinds of joints that loops of these kinds are like where all bodies move in parallel planes.
_LIKE = {
    str(JointKind.SPHERICAL): str(JointKind.FIXED),
    DISTANCE: str(JointKind.FIXED),
    str(JointKind.CYLINDRICAL): str(JointKind.REVOLUTE),
}


def held_points(mechanism: Mechanism, loop: Loop) -> tuple[float, ...]:
    """Points that a loop holds together, as distances from its position along its axis [m].

    In space a revolute loop needs two points: with one alone the axes could part without any drift of the point. Where
    all bodies move in parallel planes a second point would be redundant.
    """
    return (0.0, _APART * _size(mechanism)) if loop.kind == JointKind.REVOLUTE and not is_planar(mechanism) else (0.0,)


def is_planar(mechanism: Mechanism) -> bool:
    """True if the axes of joints and loops at the start restrict all bodies to motion in parallel planes."""
    return normal_of_plane(mechanism) is not None


def normal_of_plane(mechanism: Mechanism) -> Array | None:
    """Normal of the planes in which all bodies move, world axes; None if joints or loops allow or need another motion.

    Prismatic axes at the start must lie in that plane, and axes of turns be normal to it. Spherical loops and struts
    have no axis and count as planar, cylindrical loops as revolute ones, for nothing slides along their axis; every
    other joint or loop with more axes counts as spatial.
    """
    motion = Tree(mechanism).at(*mechanism.start())
    axes = [(str(joint.kind), A[:, 2]) for joint, A in zip(mechanism.joints, motion.R_parent, strict=True)]
    for loop in mechanism.loops:
        axis = motion.R_WB[mechanism.body_index[loop.body_a]] @ loop.frame_a[:, 2]
        axes.append((_LIKE.get(str(loop.kind), str(loop.kind)), axis))
    if any(kind not in IN_PLANE for kind, _ in axes):
        return None
    turning = [axis for kind, axis in axes if kind in {JointKind.REVOLUTE, JointKind.PLANAR}]
    sliding = [axis for kind, axis in axes if kind == JointKind.PRISMATIC]
    planar = (
        bool(turning)
        and all(np.linalg.norm(np.cross(turning[0], axis)) < _PARALLEL for axis in turning)
        and all(abs(turning[0] @ axis) < _PARALLEL for axis in sliding)
    )
    return np.asarray(turning[0]) if planar else None


def _size(mechanism: Mechanism) -> float:
    """Longest distance of a joint or loop from the origin of its body's frame [m]."""
    places: list[Array] = [np.array(joint.position) for joint in mechanism.joints]
    for loop in mechanism.loops:
        places += [np.array(loop.position_a), np.array(loop.position_b)]
    return max((float(np.linalg.norm(place)) for place in places), default=1.0) or 1.0
