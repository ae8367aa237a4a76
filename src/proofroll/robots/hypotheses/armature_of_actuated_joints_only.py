"""Armature counts only where an actuator acts on the joint."""

from __future__ import annotations

import dataclasses

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    if all(joint.actuated or not joint.armature for joint in robot.moving):
        return None
    joints = (joint if joint.actuated else dataclasses.replace(joint, armature=0.0) for joint in robot.joints)
    return robot.change(joints=tuple(joints))


HYPOTHESIS = RobotHypothesis(
    "armature is used only of joints that have an actuator",
    {"drake": "1.51.1"},
    "give every joint with armature an actuator",
    _change,
)
