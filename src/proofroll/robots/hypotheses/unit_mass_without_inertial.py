"""A link without <inertial> weighs 1 kg and has unit inertia."""

from __future__ import annotations

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot, RobotBody


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    bare = [name for name, source in robot.sources.items() if name in robot.bodies and not source.get("inertial", True)]
    if not bare:
        return None
    return robot.with_bodies(RobotBody(name, 1.0, np.zeros(3), np.eye(3)) for name in bare)


HYPOTHESIS = RobotHypothesis(
    "links without <inertial> are given 1 kg and unit inertia",
    {"pybullet": "3.2.7"},
    "give every link an <inertial>; a massless one with mass 0 and inertia 0",
    _change,
)
