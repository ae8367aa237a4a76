"""Armature of joints is not part of the mass matrix."""

from __future__ import annotations

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    loaded = any(joint.armature for joint in evidence.robot.moving)
    return evidence.robot.with_joints(armature=0.0) if loaded else None


HYPOTHESIS = RobotHypothesis(
    "armature is not included in the mass matrix",
    {"pinocchio": "before 3", "exudyn": "1.13.6 (its tree has none)"},
    "add the armature to the diagonal of the mass matrix",
    _change,
)
