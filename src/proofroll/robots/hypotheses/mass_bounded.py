"""Masses and principal moments are raised to a bound."""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Array, Robot, RobotBody

# As URDF importers of MuJoCo are commonly asked for, and as our option asks [kg], [kg m²].
_MASS, _MOMENT = 1e-6, 1e-8


def _raised(body: RobotBody, com: Array) -> RobotBody:
    values, axes = np.linalg.eigh(body.inertia)
    bounded = axes @ np.diag(np.maximum(values, _MOMENT)) @ axes.T
    return dataclasses.replace(body, mass=max(body.mass, _MASS), com=com, inertia=bounded)


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    small = []
    for joint in robot.joints:
        body = robot.bodies[joint.child]
        if body.mass < _MASS or np.linalg.eigvalsh(body.inertia)[0] < _MOMENT:
            # MuJoCo 4.0.0 puts the centre of mass of a link without <inertial> where its frame is in the parent's
            given = robot.sources.get(body.name, {}).get("inertial", True)
            small.append(_raised(body, body.com if given else joint.position))
    return robot.with_bodies(small) if small else None


HYPOTHESIS = RobotHypothesis(
    "small masses and inertias are raised to a bound (1e-6 kg, 1e-8 kg m²)",
    {"mujoco": "with boundmass, boundinertia"},
    "leave the bounds out, or correct the masses in the file",
    _change,
)
