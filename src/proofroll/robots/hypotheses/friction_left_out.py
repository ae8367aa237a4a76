"""Coulomb friction of joints is not part of the smooth dynamics."""

from __future__ import annotations

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    rubbing = any(joint.friction for joint in evidence.robot.moving)
    return evidence.robot.with_joints(friction=0.0) if rubbing else None


HYPOTHESIS = RobotHypothesis(
    "friction of joints is not used in the forward dynamics",
    {
        "pinocchio": "all versions so far",
        "mujoco": "all versions so far (frictionloss is a soft constraint of its solver)",
        "drake": "1.51.1",
        "pybullet": "3.2.7",
        "exudyn": "1.13.6 (its tree has none)",
    },
    "add the friction torque yourself; in MuJoCo slow joints slip with less than frictionloss: see solreffriction",
    _change,
)
