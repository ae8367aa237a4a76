"""Result of a check as one self-contained HTML file."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.report.pages import environment, rendered
from proofroll.robots.check.layers import SHORT
from proofroll.robots.check.records import AgainstCheck, RobotCheck
from proofroll.robots.check.terminal import amount, rounded_line, sentences

if TYPE_CHECKING:
    import jinja2

# World directions to the right and upwards in the picture, which shows the robot from the front left and above.
_RIGHT, _UP = np.array([-0.64, 0.77, 0.0]), np.array([-0.26, -0.22, 0.94])
_SIZE = 400.0
# Part of the square that stays free at each edge; half of the piece of an axis, relative to the robot; world's axes.
_EDGE, _AXIS, _FRAME = 0.08, 0.09, 26.0


def page(content: RobotCheck) -> str:
    """HTML page of a check; all text from the file and the engines is escaped."""
    pair = isinstance(content, AgainstCheck)
    parts = {"pair": pair, "short": SHORT, "skeleton": skeleton(content), "sentences": lambda row: list(sentences(row))}
    parts["rounded_line"] = rounded_line
    return rendered(_templates(), "check.html", content=content, **parts)


@cache
def _templates() -> jinja2.Environment:
    templates = environment(Path(__file__).parent / "templates")
    templates.filters["amount"] = amount
    return templates


def skeleton(content: RobotCheck) -> dict[str, Any]:
    """The robot with all coordinates at 0, seen from the front left and above, in a square that it fills.

    Returns:
        ``lines``: x1, y1, x2, y2 of each joint from the origin of its parent over its position to the origin of its
        child, the joint's data, and ``wrong``: True if an engine differs there; ``axes``: ends of a piece of each
        axis; ``centres``: x, y, arm from the body's joint, body and mass of each centre of mass; ``marks``: x, y,
        joint, body, and the engines in which the body differs or is absent; ``frame``: ends of the world's axes,
        each with its name; ``size``: side of the square.
    """
    robot = content.robot
    points = [body.position for body in robot.bodies.values()]
    points += [body.centre for body in robot.bodies.values() if body.mass > 0]
    points += [joint.position for joint in robot.joints]
    view = np.array([_RIGHT, -_UP])
    extent = float(np.ptp(np.array(points) @ view.T, axis=0).max()) or 1.0
    # The ends of axes belong to the picture, too: a robot of one body has an extent by them alone.
    pieces = {
        joint.name: np.array(joint.position) + np.outer([-_AXIS * extent, _AXIS * extent], joint.axis)
        for joint in robot.joints
        if joint.axis is not None
    }
    flat = np.concatenate([np.array(points), *pieces.values()]) @ view.T
    low, spans = flat.min(axis=0), np.ptp(flat, axis=0)
    span = float(spans.max()) or 1.0
    shift = (1 - spans / span) / 2

    def place(point: Any) -> list[float]:
        inside = (view @ np.asarray(point) - low) / span + shift
        return [float(value) for value in ((_EDGE + (1 - 2 * _EDGE) * inside) * _SIZE).round(1)]

    wrong: dict[str, list[str]] = {}
    for row in content.engines:
        for offending in row.offending:
            wrong.setdefault(offending, []).append(row.engine)
    lines, marks, axes, centres = [], [], [], []
    for joint in robot.joints:
        child = robot.bodies[joint.child]
        begin = place(robot.bodies[joint.parent].position if joint.parent in robot.bodies else joint.position)
        middle, end = place(joint.position), place(child.position)
        engines = wrong.get(joint.name, [])
        lines.append({"points": [begin, middle, end], "at": middle, **vars(joint), "wrong": bool(engines)})
        if joint.name in pieces:
            axes.append(
                {"ends": [place(point) for point in pieces[joint.name]], "kind": joint.kind, "name": joint.name}
            )
        if child.mass > 0:
            centres.append({"at": place(child.centre), "arm": middle, "body": joint.child, "mass": child.mass})
        if engines:
            marks.append({"at": middle, "joint": joint.name, "body": joint.child, "engines": engines})
    tips = [(name, (view @ direction * _FRAME).tolist()) for name, direction in zip("xyz", np.eye(3), strict=True)]
    return {"lines": lines, "axes": axes, "centres": centres, "marks": marks, "frame": tips, "size": _SIZE}
