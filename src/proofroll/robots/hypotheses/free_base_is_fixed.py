"""A free base is fixed to the world."""

from __future__ import annotations

import dataclasses

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    known = set(evidence.reading.joints)
    lost = [joint for joint in robot.joints if joint.kind == "free" and joint.name not in known]
    if not lost:
        return None
    joints = (dataclasses.replace(joint, kind="fixed") if joint in lost else joint for joint in robot.joints)
    return robot.change(joints=tuple(joints))


HYPOTHESIS = RobotHypothesis(
    "a free base without mass is fixed to the world",
    {"pybullet": "3.2.7"},
    "give the root link a mass",
    _change,
)
