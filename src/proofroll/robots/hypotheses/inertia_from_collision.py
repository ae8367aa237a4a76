"""Inertias are those of a box around the collision shapes, in the axes of the file's inertial."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Array, Robot

# Bullet's margin around shapes, also around none [m].
_MARGIN = 1e-3


def _half(kind: str, sizes: dict[str, str]) -> Array | None:
    """Half lengths of a shape's own box; None: not known here."""
    if kind == "box":
        return np.array([float(part) / 2 for part in sizes["size"].split()])
    return np.full(3, float(sizes["radius"])) if kind == "sphere" else None


def _box(mass: float, shapes: list[Any], com: Array, frame: Array) -> Array | None:
    """Principal moments in the inertial's axes, shape (3,); None: a shape whose box is not known here."""
    low, high = (np.full(3, np.inf), np.full(3, -np.inf)) if shapes else (np.zeros(3), np.zeros(3))
    for kind, sizes, position, rotation in shapes:
        half = _half(kind, sizes)
        if half is None:
            return None
        centre, reach = frame.T @ (position - com), np.abs(frame.T @ rotation) @ half
        reach = reach if kind == "box" else half
        low, high = np.minimum(low, centre - reach), np.maximum(high, centre + reach)
    x, y, z = (high - low + 2 * _MARGIN) ** 2
    return mass / 12 * np.array([y + z, x + z, x + y])


def _change(evidence: RobotEvidence) -> Robot | None:
    robot, bodies = evidence.robot, []
    for name, source in robot.sources.items():
        body = robot.bodies.get(name)
        if body is None or not source.get("inertial") or not body.mass:
            continue
        moments = _box(body.mass, source["shapes"], body.com, source["frame"])
        if moments is None:
            return None
        frame = source["frame"]
        bodies.append(dataclasses.replace(body, inertia=frame @ np.diag(moments) @ frame.T))
    return robot.with_bodies(bodies) if bodies else None


HYPOTHESIS = RobotHypothesis(
    "inertias are computed from collision shapes, not taken from the file",
    {"pybullet": "default of 3.2.7"},
    "load with flags=URDF_USE_INERTIA_FROM_FILE",
    _change,
)
