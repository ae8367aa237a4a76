"""The gravity of the file is ignored."""

from __future__ import annotations

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot

_DEFAULT = np.array([0.0, 0.0, -9.81])


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    return None if np.array_equal(robot.gravity, _DEFAULT) else robot.change(gravity=_DEFAULT)


HYPOTHESIS = RobotHypothesis(
    "the file's gravity is ignored: 9.81 m/s² downwards instead",
    {"pinocchio": "4.1.0", "drake": "1.51.1"},
    "set the gravity of the model yourself (Pinocchio: model.gravity.linear)",
    _change,
)
