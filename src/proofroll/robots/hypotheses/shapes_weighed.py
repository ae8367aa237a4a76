"""A link without <inertial> gets the mass of its collision shapes at the density of water."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Array, Robot, RobotBody, composed

_DENSITY = 1000.0


def _solid(kind: str, sizes: Mapping[str, str]) -> tuple[float, Array] | None:
    """Mass and principal moments of a shape; None: not a solid that is known here."""
    if kind == "box":
        x, y, z = (float(part) for part in sizes["size"].split())
        m = _DENSITY * x * y * z
        return m, m / 12 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    if kind == "sphere":
        r = float(sizes["radius"])
        m = _DENSITY * 4 / 3 * math.pi * r**3
        return m, np.full(3, 0.4 * m * r * r)
    if kind == "cylinder":
        r, length = float(sizes["radius"]), float(sizes["length"])
        m = _DENSITY * math.pi * r * r * length
        across = m * (r * r / 4 + length * length / 12)
        return m, np.array([across, across, m * r * r / 2])
    return None


def _weighed(name: str, shapes: list[Any]) -> RobotBody | None:
    parts = []
    for kind, sizes, position, rotation in shapes:
        solid = _solid(kind, sizes)
        if solid is None:
            return None
        mass, moments = solid
        parts.append((RobotBody("", mass, np.zeros(3), np.diag(moments)), np.array(position), np.array(rotation)))
    return composed(name, parts) if parts else None


def _change(evidence: RobotEvidence) -> Robot | None:
    robot = evidence.robot
    bare = {name: source for name, source in robot.sources.items() if not source.get("inertial", True)}
    bodies = [body for name, source in bare.items() if (body := _weighed(name, source["shapes"])) is not None]
    return robot.with_bodies(bodies) if bodies else None


HYPOTHESIS = RobotHypothesis(
    "collision shapes of links without <inertial> are weighed at 1000 kg/m³",
    {"mujoco": "all versions so far"},
    "give every link an <inertial>",
    _change,
)
