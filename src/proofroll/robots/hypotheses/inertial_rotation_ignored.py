"""The rpy of an inertial is ignored: its moments are taken in the axes of the link."""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    turned = [
        dataclasses.replace(robot.bodies[name], inertia=np.array(source["written"]))
        for name, source in robot.sources.items()
        if name in robot.bodies and "written" in source and np.any(np.array(source["frame"]) != np.eye(3))
    ]
    return robot.with_bodies(turned) if turned else None


HYPOTHESIS = RobotHypothesis(
    "the rpy of <inertial> is ignored",
    {"mujoco": "3.1.3 to 3.13.0"},
    "update the engine, or write the inertia in the axes of the link with rpy 0",
    _change,
)
