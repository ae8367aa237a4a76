"""Joints that should follow others move freely."""

from __future__ import annotations

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    return evidence.robot.change(mimics=()) if evidence.robot.mimics else None


HYPOTHESIS = RobotHypothesis(
    "mimic is ignored: the following joint moves freely",
    {
        "pinocchio": "default of all versions",
        "pybullet": "3.2.7",
        "mujoco": "3.3.3 to 3.10.0",
        "exudyn": "1.13.6 (as fed)",
    },
    "in Pinocchio build the model with mimic=True; elsewhere couple q = multiplier · q_other + offset yourself",
    _change,
)
