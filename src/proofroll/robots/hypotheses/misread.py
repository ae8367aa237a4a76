"""Causes in which an importer ignores or misreads what a file says of places, joints and attributes."""

import copy
import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.robots.files.mjcf.parse import classed
from proofroll.robots.hypotheses import WRITE_INERTIALS, RobotEvidence, hypothesis
from proofroll.robots.model import NO_BODY, Robot, RobotBody, RobotJoint
from proofroll.robots.protocol import Reading

_POSES = ("pos", "quat", "axisangle", "euler", "xyaxes", "zaxis")
# Round-off of the length of a unit axis as written.
_UNIT = 1e-12
_REWRITE = "write it at each element, or compile once with MuJoCo and save (mj_saveLastXML, six digits)"


def _without(elements: Iterable[Element], *attributes: str) -> bool:
    """Removes attributes; returns True if there were any."""
    removed = [element.attrib.pop(name, None) for element in elements for name in attributes]
    return any(value is not None for value in removed)


def _defaults(root: Element, *tags: str) -> Iterable[Element]:
    """Elements of default classes."""
    return (element for default in root.iter("default") for tag in tags for element in default.findall(tag))


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, _REWRITE)
def class_mass_ignored(evidence: RobotEvidence) -> Robot | None:
    """The mass that a default class gives to shapes is ignored: they weigh what their density says."""
    return evidence.edited(lambda root: _without(_defaults(root, "geom"), "mass"))


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, _REWRITE)
def class_pose_ignored(evidence: RobotEvidence) -> Robot | None:
    """The pose that a default class gives to joints and shapes is ignored."""
    return evidence.edited(lambda root: _without(_defaults(root, "joint", "geom"), *_POSES))


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, "write quaternions (quat) instead of angles (euler)")
def euler_sequence_in_small_letters(evidence: RobotEvidence) -> Robot | None:
    """Capital letters of eulerseq are read as small ones: turns about fixed axes become turns about moving ones."""

    def edit(root: Element) -> bool:
        capital = [
            compiler
            for compiler in root.iter("compiler")
            if compiler.get("eulerseq", "") != compiler.get("eulerseq", "").lower()
        ]
        for compiler in capital:
            compiler.set("eulerseq", compiler.get("eulerseq", "").lower())
        return bool(capital)

    return evidence.edited(edit)


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, WRITE_INERTIALS)
def inertia_groups_ignored(evidence: RobotEvidence) -> Robot | None:
    """Inertiagrouprange is ignored: shapes of all groups weigh."""
    return evidence.edited(lambda root: _without(root.iter("compiler"), "inertiagrouprange"))


def _moments(inertial: Element) -> tuple[str, list[float]] | None:
    """The attribute that holds the moments, and its numbers."""
    for name in ("diaginertia", "fullinertia"):
        if inertial.get(name):
            return name, [float(part) for part in inertial.get(name, "").split()]
    return None


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, "correct the inertia in the file, and leave balanceinertia out")
def balance_ignored(evidence: RobotEvidence) -> Robot | None:
    """Balanceinertia is ignored: impossible inertias are taken as written.

    The compiler refuses such an inertia, so it is compiled with a larger one about every axis, and the same amount is
    subtracted from the result.
    """
    root, more = copy.deepcopy(evidence.file.root), dict[str, float]()
    if not _without(root.iter("compiler"), "balanceinertia"):
        return None
    bodies = [(str(body.get("name")), inertial) for body in root.iter("body") for inertial in body.findall("inertial")]
    for name, inertial in bodies:
        principal = _moments(inertial)
        if principal is not None:
            attribute, moments = principal
            more[name] = 3 * max(map(abs, moments))
            raised = [moment + more[name] * (index < 3) for index, moment in enumerate(moments)]
            inertial.set(attribute, " ".join(map(repr, raised)))
    old, new = evidence.recompiled(evidence.file.root), evidence.recompiled(root)
    if old is None or new is None:
        return None
    lowered = (
        dataclasses.replace(body, inertia=body.inertia - more.get(name, 0.0) * np.eye(3))
        for name, body in new.bodies.items()
    )
    written = [body for body in lowered if body.name in old.bodies and _other(body, old.bodies[body.name])]
    return evidence.carried_over(old, old.with_bodies(written))


def _other(body: RobotBody, written: RobotBody) -> bool:
    """True if an inertia changed by more than the round-off of adding and subtracting the same amount."""
    return bool(np.abs(body.inertia - written.inertia).max() > 1e-9 * np.abs(body.inertia).max())


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, "write the axis of axisangle with length 1, or a quaternion")
def axisangle_not_normalised(evidence: RobotEvidence) -> Reading | None:
    """The axis of axisangle is taken as long as it is written, which gives no rotation.

    No robot has such a pose, so the proof is that the engine reads the file rightly with axes of length 1.
    """
    root, long = copy.deepcopy(evidence.file.root), False
    for element in root.iter():
        *axis, angle = (float(part) for part in element.get("axisangle", "0").split())
        length = float(np.linalg.norm(axis))
        if length and abs(length - 1) > _UNIT:
            element.set("axisangle", " ".join(repr(part) for part in (*(part / length for part in axis), angle)))
            long = True
    return evidence.reread(root) if long else None


# Radius of a ball of 1 kg with unit moments [m]: ⅖ r² = 1.
_UNIT_BALL = 2.5**0.5


@hypothesis({"pinocchio": "3.9.0 to 4.1.0"}, WRITE_INERTIALS)
def meshes_weigh_one_kilogram(evidence: RobotEvidence) -> Robot | None:
    """Every mesh weighs 1 kg, with unit inertia about its origin."""
    collides = {name: list(source.get("collides", ())) for name, source in evidence.robot.sources.items()}

    def edit(root: Element) -> bool:
        effective = {id(item.element): item.given for item in classed(root, "geom")}
        touched = False
        for body in root.iter("body"):
            shapes = body.findall("geom")
            hits = collides.get(str(body.get("name")), [])
            for shape, weighs in zip(shapes, hits if len(hits) == len(shapes) else [True] * len(shapes), strict=True):
                attributes = effective[id(shape)]
                if weighs and (attributes.get("type") == "mesh" or attributes.get("mesh")):
                    _without([shape], "mesh", "density", "shellinertia")
                    shape.attrib |= {"type": "sphere", "size": repr(_UNIT_BALL), "mass": "1"}
                    touched = True
        _without(_defaults(root, "geom"), "mesh")
        return touched

    return evidence.edited(edit)


def _lawless(law: str, robot: Robot) -> Robot | None:
    return robot.with_joints(**{law: 0.0}) if any(getattr(joint, law) for joint in robot.moving) else None


@hypothesis(
    {"pinocchio": "before 3", "exudyn": "1.13.6 (its tree has none)"},
    "add the armature to the diagonal of the mass matrix",
)
def armature_left_out(evidence: RobotEvidence) -> Robot | None:
    """Armature is not included in the mass matrix."""
    return _lawless("armature", evidence.robot)


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
    return _lawless("damping", evidence.robot)


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
    return _lawless("friction", evidence.robot)


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
    return _lawless("stiffness", evidence.robot)


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
            # Massless bodies ``name/0`` … connect several joints of a body in the file.
            several = joint.parent.rpartition("/")[0] == joint.child or joint.child.rpartition("/")[0] in robot.bodies
            kept = joint.armature if several else 0.0
            joints.append(dataclasses.replace(joint, name=again, parent=NO_BODY, child=again, armature=kept))
    return robot.change(bodies=bodies, joints=tuple(joints))


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
