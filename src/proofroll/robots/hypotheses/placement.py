"""Causes that misplace or drop bodies, and the cause of a wrong gravity."""

import dataclasses
from collections.abc import Sequence
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.robots.hypotheses import RobotEvidence, hypothesis
from proofroll.robots.model import NO_BODY, Robot, RobotBody, RobotJoint


@hypothesis({"drake": "1.51.1"}, "give each further joint a body of its own without mass")
def body_placed_by_last_joint(evidence: RobotEvidence) -> Robot | None:
    """All but the last of several joints in one body are placed in the parent's frame.

    The body's pose is applied at the last joint.
    """
    robot = evidence.robot
    chains: dict[str, list[int]] = {}
    for index, joint in enumerate(robot.joints):
        body, _, extra = joint.child.rpartition("/")
        chains.setdefault(body if extra.isdigit() else joint.child, []).append(index)
    joints = list(robot.joints)
    for chain in chains.values():
        joint_1, last = joints[chain[0]], joints[chain[-1]]
        if len(chain) == 1:
            continue
        p = joint_1.position - joint_1.rotation @ joint_1.child_position
        joints[chain[0]] = dataclasses.replace(joint_1, position=joint_1.child_position, rotation=np.eye(3))
        placed = p + joint_1.rotation @ last.child_position
        joints[chain[-1]] = dataclasses.replace(last, position=placed, rotation=joint_1.rotation)
    return robot.change(joints=tuple(joints)) if len(chains) < len(joints) else None


_DEFAULT = np.array([0.0, 0.0, -9.81])


@hypothesis(
    {"pinocchio": "4.1.0", "drake": "1.51.1"}, "set the gravity of the model yourself (Pinocchio: model.gravity.linear)"
)
def default_gravity(evidence: RobotEvidence) -> Robot | None:
    """The file's gravity is ignored: 9.81 m/s² downwards instead."""
    robot = evidence.robot
    return None if np.array_equal(robot.gravity, _DEFAULT) else robot.change(gravity=_DEFAULT)


@hypothesis(
    {"pinocchio": "4.1.0"}, "put everything under one body of the world, or read each tree from a file of its own"
)
def first_tree_only(evidence: RobotEvidence) -> Robot | None:
    """Only the first tree under the world is read."""
    robot, kept = evidence.robot, {NO_BODY}
    joints: list[RobotJoint] = []
    for joint in robot.joints:
        if joint.parent in kept and not (joint.parent == NO_BODY and joints):
            kept.add(joint.child)
            joints.append(joint)
    return _with_joints(robot, joints) if len(joints) < len(robot.joints) else None


def _with_joints(robot: Robot, joints: Sequence[RobotJoint]) -> Robot:
    """Robot with only these joints, and the bodies and mimics that belong to them."""
    moving, kept = {joint.name for joint in joints}, {joint.child for joint in joints}
    mimics = tuple(mimic for mimic in robot.mimics if {mimic.joint, mimic.other} <= moving)
    bodies = {name: body for name, body in robot.bodies.items() if name in kept}
    return robot.change(joints=tuple(joints), bodies=bodies, mimics=mimics)


@hypothesis({"pinocchio": "4.1.0"}, "write the poses of what stands in a <frame> without it")
def frames_ignored(evidence: RobotEvidence) -> Robot | None:
    """Elements inside a <frame> are not read."""
    frames = list(evidence.root.iter("frame"))
    if not frames:
        return None
    lost = {body.get("name") for frame in frames for body in frame.iter("body")}
    robot = evidence.edited(_without_frames) or evidence.robot
    return _with_joints(robot, [joint for joint in robot.joints if joint.child.partition("/")[0] not in lost])


def _without_frames(root: Element) -> bool:
    for parent in list(root.iter()):
        for frame in parent.findall("frame"):
            parent.remove(frame)
    return True


@hypothesis({"pinocchio": "4.1.0"}, "write one <worldbody>")
def tree_read_again(evidence: RobotEvidence) -> Robot | None:
    """The first tree is read once for every <worldbody>: its masses are added again, with joints that carry nothing.

    Of these joints, those that share a body with others keep their armature.
    """
    robot, file = evidence.robot, evidence.file
    times = sum(1 for _ in file.root.iter("worldbody"))
    if file.kind != "mjcf" or times < 2:
        return None
    heavier = (
        dataclasses.replace(body, mass=times * body.mass, inertia=times * body.inertia)
        for body in robot.bodies.values()
    )
    bodies, joints = {body.name: body for body in heavier}, list(robot.joints)
    for name, joint in ((joint.name, joint) for joint in robot.moving):
        for again in (f"{name} ({number})" for number in range(2, times + 1)):
            bodies[again] = RobotBody(again, 0.0, np.zeros(3), np.zeros((3, 3)))
            kept = joint.armature if _one_of_several(joint, robot) else 0.0
            joints.append(dataclasses.replace(joint, name=again, parent=NO_BODY, child=again, armature=kept))
    return robot.change(bodies=bodies, joints=tuple(joints))


def _one_of_several(joint: RobotJoint, robot: Robot) -> bool:
    """True if the joint's body has further joints in the file: massless bodies ``name/0`` … connect them."""
    return joint.parent.rpartition("/")[0] == joint.child or joint.child.rpartition("/")[0] in robot.bodies


@hypothesis({"pybullet": "3.2.7"}, "give the root link a mass")
def free_base_is_fixed(evidence: RobotEvidence) -> Robot:
    """A free base without mass is fixed to the world."""
    names = set(evidence.reading.joints)
    return evidence.robot.with_each_joint(
        lambda joint: (
            dataclasses.replace(joint, kind=JointKind.FIXED)
            if joint.kind == JointKind.FREE and joint.name not in names
            else joint
        )
    )


def _offset(joint: RobotJoint, robot: Robot) -> RobotJoint:
    source = robot.sources.get(joint.child, {})
    if joint.kind != JointKind.FREE or "rotation" not in source:
        return joint
    p = np.array(source["position"])
    offset = p - np.array(source["rotation"]) @ p
    return dataclasses.replace(joint, position=offset) if np.any(offset) else joint


@hypothesis(
    {"pinocchio": "4.1.0"}, "write free bodies with pos 0 0 0 or without rotation, and set the start in the coordinates"
)
def free_body_offset(evidence: RobotEvidence) -> Robot:
    """A free body whose pose (p, R) in the file is turned is offset by p − R p.

    The pose is undone in the wrong order.
    """
    return evidence.robot.with_each_joint(lambda joint: _offset(joint, evidence.robot))


@hypothesis(
    {"pinocchio": "3.9.0 to 4.1.0"},
    "put the pose into the next body, or multiply the poses of the model by it; update Pinocchio once that is released",
)
def root_pose_dropped(evidence: RobotEvidence) -> Robot | None:
    """The pose of the first body is dropped where it has no joint.

    All that it carries is placed as if it lay at the origin of the world.
    """
    robot = evidence.robot
    if not robot.joints or robot.joints[0].kind != JointKind.FIXED:
        return None
    root_joint = robot.joints[0]
    if not np.any(root_joint.position) and np.array_equal(root_joint.rotation, np.eye(3)):
        return None
    dropped = dataclasses.replace(root_joint, position=np.zeros(3), rotation=np.eye(3))
    return robot.change(joints=(dropped, *robot.joints[1:]))
