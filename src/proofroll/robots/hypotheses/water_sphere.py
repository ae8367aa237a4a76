"""An impossible inertia is replaced by that of a sphere of water with the same mass."""

from __future__ import annotations

import dataclasses

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.inertia import replaced
from proofroll.robots.model import Robot, RobotBody

# Density of water [kg/m³].
_WATER = 1000.0


def _sphere(body: RobotBody) -> RobotBody:
    mass = body.mass or 1.0
    radius = (3 * mass / (4 * np.pi * _WATER)) ** (1 / 3)
    return dataclasses.replace(body, mass=mass, inertia=0.4 * mass * radius**2 * np.eye(3))


def _change(evidence: RobotEvidence) -> Robot | None:
    return replaced(evidence, _sphere)


HYPOTHESIS = RobotHypothesis(
    "an impossible inertia is replaced by that of a sphere of water (of 1 kg where the mass is 0)",
    {"drake": "1.51.1 (a line of its log says so)"},
    "correct the inertia in the file",
    _change,
)
