"""The result of a check as one HTML file that needs nothing else."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.report.pages import environment, rendered
from proofroll.robots.layers import SHORT
from proofroll.robots.records import AgainstCheck, RobotCheck
from proofroll.robots.terminal import amount, sentences

if TYPE_CHECKING:
    import jinja2

# The robot is seen from the front, the left and above: directions to the right and up in the picture.
_RIGHT, _UP = np.array([-0.64, 0.77, 0.0]), np.array([-0.26, -0.22, 0.94])
_SIZE = 400.0


def page(content: RobotCheck) -> str:
    """The HTML page; everything from the file and the engines is escaped."""
    pair = isinstance(content, AgainstCheck)
    said = {"pair": pair, "short": SHORT, "skeleton": skeleton(content), "sentences": lambda row: list(sentences(row))}
    return rendered(_templates(), "check.html", content=content, **said)


@cache
def _templates() -> jinja2.Environment:
    made = environment(Path(__file__).parent / "templates")
    made.filters["amount"] = amount
    return made


def skeleton(content: RobotCheck) -> dict[str, Any]:
    """The robot at rest coordinates as lines between the origins of its bodies, in a square of 400 units.

    Returns:
        ``lines`` and ``marks``: lines with ends x1, y1, x2, y2, the joint and its kind; marks with x, y, the joint and
        the engines that hold what it carries differently, or lack it.
    """
    flat = {name: np.array([_RIGHT, -_UP]) @ body.position for name, body in content.robot.bodies.items()}
    points = np.array([*flat.values()])
    low, span = points.min(axis=0), float(np.ptp(points, axis=0).max()) or 1.0
    shift = (1 - np.ptp(points, axis=0) / span) / 2
    place = {name: (0.06 + 0.88 * ((point - low) / span + shift)) * _SIZE for name, point in flat.items()}
    wrong: dict[str, list[str]] = {}
    for row in content.engines:
        for offending in row.offending:
            wrong.setdefault(offending, []).append(row.engine)
    lines, marks = [], []
    for joint in content.robot.joints:
        x2, y2 = place[joint.child].round(1).tolist()
        x1, y1 = place.get(joint.parent, place[joint.child]).round(1).tolist()
        engines = wrong.get(joint.name, [])
        lines.append({"x1": x1, "y1": y1, "x2": x2, "y2": y2, **vars(joint), "wrong": bool(engines)})
        if engines:
            marks.append({"x": x2, "y": y2, "joint": joint.name, "body": joint.child, "engines": engines})
    return {"lines": lines, "marks": marks, "size": _SIZE}
