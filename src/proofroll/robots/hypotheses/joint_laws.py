"""Causes that change forces and inertia in joints: armature, damping, friction, springs, couplings."""

import copy
import dataclasses
from typing import Any
from xml.etree.ElementTree import SubElement

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.robots.hypotheses import RobotEvidence, hypothesis
from proofroll.robots.model import Robot


def _without(law: str, robot: Robot) -> Robot | None:
    return robot.with_joints(**{law: 0.0}) if any(getattr(joint, law) for joint in robot.moving) else None


@hypothesis(
    {"pinocchio": "before 3", "exudyn": "1.13.6 (its tree has none)"},
    "add the armature to the diagonal of the mass matrix",
)
def armature_left_out(evidence: RobotEvidence) -> Robot | None:
    """Armature is not included in the mass matrix."""
    return _without("armature", evidence.robot)


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, "write free joints without armature: nothing is geared there")
def armature_of_free_joints_turns(evidence: RobotEvidence) -> Robot:
    """Armature of a free joint acts along axes that turn with the body.

    The engine multiplies it with the derivative of the velocity's components in body axes. The file means those in
    world axes; they differ by ω × v.
    """
    return evidence.robot.with_each_joint(
        lambda joint: (
            dataclasses.replace(joint, turning=True) if joint.kind == JointKind.FREE and joint.armature else joint
        )
    )


@hypothesis({"drake": "1.51.1"}, "give every joint with armature an actuator")
def armature_of_actuated_joints_only(evidence: RobotEvidence) -> Robot:
    """Armature is used only of joints that have an actuator."""
    return evidence.robot.with_each_joint(
        lambda joint: joint if joint.actuated or not joint.armature else dataclasses.replace(joint, armature=0.0)
    )


@hypothesis(
    {"pinocchio": "all versions so far"},
    "subtract damping · velocity from the torques yourself (Pinocchio keeps it in model.damping)",
)
def damping_left_out(evidence: RobotEvidence) -> Robot | None:
    """Damping is not used in the forward dynamics."""
    return _without("damping", evidence.robot)


_LAWS = ("damping", "armature", "stiffness", "friction")


@hypothesis({"drake": "1.51.1"}, "put an empty <joint/> into every default class")
def defaults_not_inherited(evidence: RobotEvidence) -> Robot | None:
    """A default class without a <joint> of its own loses the joint defaults of the class around it."""
    robot, root = evidence.robot, copy.deepcopy(evidence.file.root)
    bare = [
        inner for outer in root.iter("default") for inner in outer.findall("default") if inner.find("joint") is None
    ]
    for default in bare:
        SubElement(default, "joint", {"damping": "0", "armature": "0", "stiffness": "0", "frictionloss": "0"})
    compiled = evidence.recompiled(root) if bare else None
    if compiled is None:
        return None
    of_engine = {joint.name: joint for joint in compiled.joints}
    changes: dict[str, dict[str, Any]] = {
        joint.name: {law: 0.0 for law in _LAWS if getattr(joint, law) and not getattr(of_engine[joint.name], law)}
        for joint in robot.joints
        if joint.name in of_engine
    }
    return robot.with_each_joint(
        lambda joint: dataclasses.replace(joint, **changes[joint.name]) if changes.get(joint.name) else joint
    )


@hypothesis(
    {
        "pinocchio": "all versions so far",
        "drake": "1.51.1",
        "pybullet": "3.2.7",
        "exudyn": "1.13.6 (its tree has none)",
    },
    "add the friction torque yourself",
)
def friction_left_out(evidence: RobotEvidence) -> Robot | None:
    """Friction of joints is not used in the forward dynamics."""
    return _without("friction", evidence.robot)


@hypothesis(
    {
        "pinocchio": "default of all versions",
        "pybullet": "3.2.7",
        "mujoco": "3.3.3 to 3.10.0",
        "exudyn": "1.13.6 (as fed)",
    },
    "in Pinocchio build the model with mimic=True; elsewhere couple q = multiplier · q_other + offset yourself",
)
def mimic_ignored(evidence: RobotEvidence) -> Robot | None:
    """Mimic is ignored: the following joint moves freely."""
    return evidence.robot.change(mimics=()) if evidence.robot.mimics else None


@hypothesis(
    {"pinocchio": "4.1.0", "drake": "1.51.1", "exudyn": "1.13.6"},
    "add stiffness · (coordinate − springref) to the torques yourself",
)
def springs_left_out(evidence: RobotEvidence) -> Robot | None:
    """Springs of joints are not used in the forward dynamics."""
    return _without("stiffness", evidence.robot)
