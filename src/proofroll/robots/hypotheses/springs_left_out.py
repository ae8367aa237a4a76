"""Springs of joints are not used."""

from __future__ import annotations

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    sprung = any(joint.stiffness for joint in evidence.robot.moving)
    return evidence.robot.with_joints(stiffness=0.0) if sprung else None


HYPOTHESIS = RobotHypothesis(
    "springs of joints are not used in the forward dynamics",
    {"pinocchio": "4.1.0", "drake": "1.51.1", "exudyn": "1.13.6"},
    "add stiffness · (coordinate − springref) to the torques yourself",
    _change,
)
