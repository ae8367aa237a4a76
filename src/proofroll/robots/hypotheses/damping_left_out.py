"""Damping of joints is read but not used in the dynamics."""

from __future__ import annotations

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    damped = any(joint.damping for joint in evidence.robot.moving)
    return evidence.robot.with_joints(damping=0.0) if damped else None


HYPOTHESIS = RobotHypothesis(
    "damping is not used in the forward dynamics",
    {"pinocchio": "all versions so far"},
    "subtract damping · velocity from the torques yourself (Pinocchio keeps it in model.damping)",
    _change,
)
