"""An impossible inertia is replaced by a sphere with the mean principal moment."""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.inertia import replaced
from proofroll.robots.model import Robot, RobotBody


def _sphere(body: RobotBody) -> RobotBody:
    return dataclasses.replace(body, inertia=np.trace(body.inertia) / 3 * np.eye(3))


def _change(evidence: RobotEvidence) -> Robot | None:
    return replaced(evidence, _sphere)


HYPOTHESIS = RobotHypothesis(
    "an impossible inertia is replaced by a sphere with the mean of its principal moments",
    {"mujoco": "with balanceinertia"},
    "correct the inertia in the file, and leave balanceinertia out",
    _change,
)
