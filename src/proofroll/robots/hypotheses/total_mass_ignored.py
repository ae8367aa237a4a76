"""The total mass that the file asks for is not set: all masses and inertias keep the scale that was written."""

from __future__ import annotations

import dataclasses

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot


def _change(evidence: RobotEvidence) -> Robot | None:
    robot, held = evidence.robot, evidence.reading.mass
    if not any(compiler.get("settotalmass") for compiler in evidence.file.root.iter("compiler")):
        return None
    scaled = sum(group.mass for name, group in robot.groups.items() if name in held)
    if not scaled:
        return None
    factor = sum(mass for name, mass in held.items() if name in robot.groups) / scaled
    return robot.with_bodies(
        dataclasses.replace(body, mass=factor * body.mass, inertia=factor * body.inertia)
        for body in robot.bodies.values()
    )


HYPOTHESIS = RobotHypothesis(
    "settotalmass is ignored: masses are as written",
    {"pinocchio": "4.1.0", "drake": "1.51.1"},
    "compile the file once with MuJoCo, save it (mj_saveLastXML), and give others the saved file",
    _change,
)
