"""Whether an inertia can belong to a rigid body, and which bodies an engine holds with another one than the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence
from proofroll.robots.model import Array, Robot, RobotBody

# Round-off of numbers that were written with six or more digits is no defect of a body.
_ROUNDING = 1e-9


def moments(inertia: Array) -> Array:
    """Principal moments, smallest first, shape (3,)."""
    return np.asarray(np.linalg.eigvalsh(inertia), dtype=np.float64)


def not_positive(inertia: Array) -> bool:
    """Whether a principal moment is zero or negative."""
    return bool(moments(inertia)[0] <= 0)


def breaks_triangle(inertia: Array) -> bool:
    """Whether the largest principal moment exceeds the sum of the others by more than round-off."""
    small, middle, large = moments(inertia)
    return bool(large > (small + middle) * (1 + _ROUNDING))


def replaced(evidence: RobotEvidence, instead: Callable[[RobotBody], RobotBody]) -> Robot | None:
    """The robot with other values for each body whose inertia is impossible and that the engine holds differently."""
    bodies = [instead(body) for body in _suspects(evidence)]
    return evidence.robot.with_bodies(bodies) if bodies else None


def _suspects(evidence: RobotEvidence) -> Iterator[RobotBody]:
    """An engine's own rule of what is impossible is not predicted: what it holds is looked at."""
    robot, reading = evidence.robot, evidence.reading
    scale = max((float(np.abs(group.inertia).max()) for group in robot.groups.values()), default=1.0)
    other = {
        name
        for name, group in robot.groups.items()
        if name in reading.inertia and np.abs(reading.inertia[name] - group.inertia).max() > 1e-10 * scale
    }
    for name, (home, _, _) in robot.welded.items():
        body = robot.bodies.get(name)
        alone = sum(carrier == home for carrier, _, _ in robot.welded.values()) == 1
        if body is not None and home in other:
            impossible = breaks_triangle(body.inertia) or not_positive(body.inertia)
            if alone or (impossible and np.any(body.inertia)) or (not body.mass and np.any(body.inertia)):
                yield body
