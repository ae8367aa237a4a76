"""Causes that change masses and inertias computed from shapes."""

import dataclasses
import itertools
import math
from collections.abc import Mapping
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.robots.hypotheses import WRITE_INERTIALS, RobotEvidence, hypothesis
from proofroll.robots.hypotheses.inertias import bounded_from_below
from proofroll.robots.model import Array, Robot, RobotBody, composed

# Bullet's margin around the box of a body's shapes, also if it has no shape [m].
_MARGIN = 1e-3


def _half(kind: str, sizes: dict[str, str]) -> Array | None:
    """Half lengths of a shape's bounding box [m], shape (3,); None: the kind of shape is not covered."""
    name, count, part = {"box": ("size", 3, 0.5), "sphere": ("radius", 1, 1.0)}.get(kind, ("", 0, 0.0))
    try:
        lengths = [part * float(length) for length in sizes.get(name, "").split()]
    except ValueError:
        return None
    return np.full(3, lengths) if count and len(lengths) == count else None


def _box(mass: float, shapes: list[Any], com: Array, frame: Array) -> Array | None:
    """Principal moments of the box around all shapes, in the inertial's axes [kg m²], shape (3,).

    None: a shape is not covered.
    """
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


@hypothesis({"pybullet": "default of 3.2.7"}, "load with flags=URDF_USE_INERTIA_FROM_FILE")
def inertia_from_collision(evidence: RobotEvidence) -> Robot | None:
    """Inertias are computed from collision shapes, not taken from the file.

    Inertias are those of a box around the shapes, in the axes of the file's inertial.
    """
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
    return robot.with_bodies(bodies)


@hypothesis({"pinocchio": "4.1.0"}, WRITE_INERTIALS)
def noncolliding_shapes_weightless(evidence: RobotEvidence) -> Robot | None:
    """Shapes that collide with nothing (contype 0, conaffinity 0) give no mass."""
    sources = evidence.robot.sources

    def edit(root: Element) -> bool:
        touched = False
        for body in root.iter("body"):
            shapes = body.findall("geom")
            collides = sources.get(str(body.get("name")), {}).get("collides", [])
            if len(shapes) != len(collides) or all(collides):
                continue
            touched = True
            for shape, hits in zip(shapes, collides, strict=True):
                if not hits:
                    body.remove(shape)
        bounded_from_below(root, replace=False)
        return touched

    return evidence.edited(edit)


_DENSITY = 1000.0


def _solid(kind: str, sizes: Mapping[str, str]) -> tuple[float, Array] | None:
    """Mass [kg] and principal moments [kg m²] of a shape at 1000 kg/m³; None: the kind of shape is not covered."""
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


@hypothesis({"mujoco": "all versions so far"}, "give every link an <inertial>")
def shapes_weighed(evidence: RobotEvidence) -> Robot:
    """Collision shapes of links without <inertial> are weighed at 1000 kg/m³."""
    robot = evidence.robot
    bare = {name: source["shapes"] for name, source in robot.sources.items() if not source.get("inertial", True)}
    return robot.with_bodies(filter(None, itertools.starmap(_weighed, bare.items())))


@hypothesis({"pybullet": "3.2.7"}, "give every link an <inertial>; a massless one with mass 0 and inertia 0")
def unit_mass_without_inertial(evidence: RobotEvidence) -> Robot:
    """Links without <inertial> are given 1 kg and unit inertia."""
    robot = evidence.robot
    bare = (name for name, source in robot.sources.items() if name in robot.bodies and not source.get("inertial", True))
    return robot.with_bodies(RobotBody(name, 1.0, np.zeros(3), np.eye(3)) for name in bare)
