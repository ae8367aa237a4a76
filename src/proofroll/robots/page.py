"""Result of a check as one self-contained HTML file."""

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

# World directions to the right and upwards in the picture, which shows the robot from the front left and above.
_RIGHT, _UP = np.array([-0.64, 0.77, 0.0]), np.array([-0.26, -0.22, 0.94])
_SIZE = 400.0


def page(content: RobotCheck) -> str:
    """HTML page of a check; all text from the file and the engines is escaped."""
    pair = isinstance(content, AgainstCheck)
    parts = {"pair": pair, "short": SHORT, "skeleton": skeleton(content), "sentences": lambda row: list(sentences(row))}
    return rendered(_templates(), "check.html", content=content, **parts)


@cache
def _templates() -> jinja2.Environment:
    templates = environment(Path(__file__).parent / "templates")
    templates.filters["amount"] = amount
    return templates


def skeleton(content: RobotCheck) -> dict[str, Any]:
    """The robot at rest coordinates as lines between the origins of its bodies, in a square of 400 units.

    Returns:
        ``lines``: ends x1, y1, x2, y2, the joint's data, and ``wrong``: True if an engine differs there; ``marks``: x,
        y, joint, body, and the engines in which the body differs or is absent; ``size``: side of the square.
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
