"""Points that close a loop, for engines whose constraints hold points together and nothing else."""

import numpy as np

from proofroll.elements.mechanism.kinematics import Tree
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Loop
from proofroll.elements.mechanism.rotations import Array

# Part of the mechanism's size by which the two points on the axis of a revolute loop are apart.
_APART = 0.3
_PARALLEL = 1e-9  # round-off of directions


def held_points(mechanism: Mechanism, loop: Loop) -> tuple[float, ...]:
    """Points that a loop holds together, as distances from its position along its axis [m].

    In space a revolute loop needs two points; with one, the bodies turn about it freely, and no drift would tell.
    Where everything moves in parallel planes the second would hold nothing that is not held already.
    """
    return (0.0, _APART * _size(mechanism)) if loop.kind == "revolute" and not is_planar(mechanism) else (0.0,)


def is_planar(mechanism: Mechanism) -> bool:
    """True if all joints and loops let the bodies move in parallel planes alone, by their axes at the start.

    Slides must lie in that plane and turns stand on it; what has other axes is taken to be spatial, but for a loop that
    has none.
    """
    motion = Tree(mechanism).at(*mechanism.start())
    axes = [(joint.kind, A[:, 2]) for joint, A in zip(mechanism.joints, motion.R_parent, strict=True)]
    for loop in mechanism.loops:
        R = motion.R_WB[mechanism.body_index[loop.body_a]]
        axes.append(("fixed" if loop.kind == "spherical" else loop.kind, R @ loop.frame_a[:, 2]))
    if any(kind not in {"fixed", "revolute", "prismatic", "planar"} for kind, _ in axes):
        return False
    turning = [axis for kind, axis in axes if kind in {"revolute", "planar"}]
    sliding = [axis for kind, axis in axes if kind == "prismatic"]
    return (
        bool(turning)
        and all(np.linalg.norm(np.cross(turning[0], axis)) < _PARALLEL for axis in turning)
        and all(abs(turning[0] @ axis) < _PARALLEL for axis in sliding)
    )


def _size(mechanism: Mechanism) -> float:
    """The longest distance of a joint or loop from its body's frame [m]."""
    places: list[Array] = [np.array(joint.position) for joint in mechanism.joints]
    for loop in mechanism.loops:
        places += [np.array(loop.position_a), np.array(loop.position_b)]
    return max((float(np.linalg.norm(place)) for place in places), default=1.0) or 1.0
