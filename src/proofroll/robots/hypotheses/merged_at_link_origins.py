"""Links at fixed joints are merged at the links' origins, their principal moments taken about the axes of the whole."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.optimize import linear_sum_assignment

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Array, Robot, RobotBody


def _moments(inertia: Array) -> Array:
    """Principal moments, each at the axis that it is nearest to."""
    values, axes = np.linalg.eigh(inertia)
    _, order = linear_sum_assignment(-np.abs(axes))
    return np.asarray(values[order])


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    bodies: list[RobotBody] = []
    for home in robot.columns:
        members = [(name, p, R) for name, (carrier, p, R) in robot.welded.items() if carrier == home]
        if len(members) == 1:
            continue
        for name, _, R in members:
            body = robot.bodies[name]
            written = np.array(robot.sources.get(name, {}).get("written", body.inertia))
            held = R.T @ np.diag(_moments(written)) @ R  # so that turned with the link they have the whole's axes
            bodies.append(dataclasses.replace(body, com=np.zeros(3), inertia=held))
    return robot.with_bodies(bodies) if bodies else None


HYPOTHESIS = RobotHypothesis(
    "links at fixed joints are merged by their origins: inertial origins and rotations are dropped",
    {"pybullet": "3.2.7 with URDF_MERGE_FIXED_LINKS"},
    "load without URDF_MERGE_FIXED_LINKS",
    _change,
)
