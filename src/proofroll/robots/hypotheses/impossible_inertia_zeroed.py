"""An impossible inertia is replaced by zero."""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.inertia import replaced
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    return replaced(evidence, lambda body: dataclasses.replace(body, inertia=np.zeros((3, 3))))


HYPOTHESIS = RobotHypothesis(
    "an impossible inertia is replaced by zero",
    {"pybullet": "3.2.7", "mujoco": "4.0.0 (of a link without mass)"},
    "correct the inertia in the file",
    _change,
)
