"""A link that is merged into its parent is placed in the wrong order, and its principal axes are not turned with it."""

from __future__ import annotations

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.hypotheses.merged_inertial_misplaced import misplaced
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    return misplaced(evidence, turned=False)


HYPOTHESIS = RobotHypothesis(
    "the inertial of a merged link is placed in the wrong order and not turned (default fusestatic for URDF)",
    {"mujoco": "3.3.3"},
    'update MuJoCo, or put <mujoco><compiler fusestatic="false"/></mujoco> into the file',
    _change,
)
