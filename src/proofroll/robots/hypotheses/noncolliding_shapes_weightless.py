"""Shapes that collide with nothing (contype and conaffinity 0) give a body no mass."""

from __future__ import annotations

import copy
import dataclasses
from xml.etree.ElementTree import SubElement

import numpy as np

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot

# A body must weigh something to be compiled; what it weighs is taken away again.
_STAND_IN = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}


def _change(evidence: RobotEvidence) -> Robot | None:
    robot, root = evidence.robot, copy.deepcopy(evidence.file.root)
    bare, touched = set(), False
    for body in root.iter("body"):
        name, shapes = str(body.get("name")), body.findall("geom")
        collides = robot.sources.get(name, {}).get("collides", [])
        if len(shapes) != len(collides) or all(collides):
            continue
        touched = True
        for shape, hits in zip(shapes, collides, strict=True):
            if not hits:
                body.remove(shape)
        if not any(collides) and body.find("inertial") is None:
            SubElement(body, "inertial", _STAND_IN)
            bare.add(name)
    compiled = evidence.recompiled(root) if touched else None
    if compiled is None:
        return None
    nothing = np.zeros((3, 3))
    lighter = (
        dataclasses.replace(body, mass=0.0, com=np.zeros(3), inertia=nothing) if body.name in bare else body
        for body in compiled.bodies.values()
    )
    return robot.with_bodies(body for body in lighter if body.name in robot.bodies)


HYPOTHESIS = RobotHypothesis(
    "shapes that collide with nothing (contype 0, conaffinity 0) give no mass",
    {"pinocchio": "4.1.0"},
    "give every body an <inertial>; compile once with MuJoCo and save (mj_saveLastXML) to get one",
    _change,
)
