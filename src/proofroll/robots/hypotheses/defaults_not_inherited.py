"""A default class without a <joint> element takes over nothing for joints from the class around it."""

from __future__ import annotations

import copy
import dataclasses
from typing import Any
from xml.etree.ElementTree import SubElement

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import Robot

_LAWS = ("damping", "armature", "stiffness", "friction")


def _change(evidence: RobotEvidence) -> Robot | None:
    robot, root = evidence.robot, copy.deepcopy(evidence.file.root)
    bare = [
        inner for outer in root.iter("default") for inner in outer.findall("default") if inner.find("joint") is None
    ]
    for default in bare:
        SubElement(default, "joint", {"damping": "0", "armature": "0", "stiffness": "0", "frictionloss": "0"})
    compiled = evidence.recompiled(root) if bare else None
    if compiled is None:
        return None
    held = {joint.name: joint for joint in compiled.joints}
    changes: dict[str, dict[str, Any]] = {
        joint.name: {law: 0.0 for law in _LAWS if getattr(joint, law) and not getattr(held[joint.name], law)}
        for joint in robot.joints
        if joint.name in held
    }
    if not any(changes.values()):
        return None
    return robot.change(
        joints=tuple(dataclasses.replace(joint, **changes.get(joint.name, {})) for joint in robot.joints)
    )


HYPOTHESIS = RobotHypothesis(
    "a default class without a <joint> of its own loses the joint defaults of the class around it",
    {"drake": "1.51.1"},
    "put an empty <joint/> into every default class",
    _change,
)
