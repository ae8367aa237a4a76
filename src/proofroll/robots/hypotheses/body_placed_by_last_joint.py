"""Of several joints in one body all but the last sit in the parent's frame: the body's own pose comes with the last."""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    chains: dict[str, list[int]] = {}
    for index, joint in enumerate(robot.joints):
        body, _, extra = joint.child.rpartition("/")
        chains.setdefault(body if extra.isdigit() else joint.child, []).append(index)
    joints = list(robot.joints)
    for chain in chains.values():
        first, last = joints[chain[0]], joints[chain[-1]]
        if len(chain) == 1:
            continue
        p = first.position - first.rotation @ first.child_position
        joints[chain[0]] = dataclasses.replace(first, position=first.child_position, rotation=np.eye(3))
        placed = p + first.rotation @ last.child_position
        joints[chain[-1]] = dataclasses.replace(last, position=placed, rotation=first.rotation)
    return robot.change(joints=tuple(joints)) if len(chains) < len(joints) else None


HYPOTHESIS = RobotHypothesis(
    "of several joints in one body all but the last are placed in the parent's frame",
    {"drake": "1.51.1"},
    "give each further joint a body of its own without mass",
    _change,
)
