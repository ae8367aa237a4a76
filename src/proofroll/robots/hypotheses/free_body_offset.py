"""A free body that the file turns is offset: its pose (p, R) is undone in the wrong order, which leaves p − R p."""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot, RobotJoint


def _offset(joint: RobotJoint, robot: Robot) -> RobotJoint:
    source = robot.sources.get(joint.child, {})
    if joint.kind != "free" or "rotation" not in source:
        return joint
    p = np.array(source["position"])
    offset = p - np.array(source["rotation"]) @ p
    return dataclasses.replace(joint, position=offset) if np.any(offset) else joint


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    joints = tuple(_offset(joint, robot) for joint in robot.joints)
    changed = any(one is not other for one, other in zip(joints, robot.joints, strict=True))
    return robot.change(joints=joints) if changed else None


HYPOTHESIS = RobotHypothesis(
    "a free body whose pose (p, R) in the file is turned is offset by p − R p",
    {"pinocchio": "4.1.0"},
    "write free bodies with pos 0 0 0 or without rotation, and set the start in the coordinates",
    _change,
)
