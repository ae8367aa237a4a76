"""Remarks on errors and risks in a robot file, found without any engine."""

import math
from collections import Counter
from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.elements.mechanism.reading.plausibility import LARGE, doubtful_body
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.robots.files.mjcf.parse import classed
from proofroll.robots.files.robot_file import LintRemark, RobotFile, floats, numbers
from proofroll.robots.hypotheses.inertias import incomplete_inertias
from proofroll.robots.model import Robot

# Level, where and what of a :class:`LintRemark`.
_Noticed = tuple[str, str, str]
# Largest error of the length of a unit axis that is written with six digits.
_UNIT = 1e-6
# Limits of an angle between these are probably degrees [rad]: joints turn twice at most, and larger numbers mean none.
_TURNS = 4 * math.pi, 720.0
# Attributes with which a free joint is damped, loaded or held like any other joint.
_LAWS = ("damping", "armature", "frictionloss", "stiffness")
# Common angles in radians, by which a range in the wrong unit is recognised where degrees are read.
_IN_RADIANS = (1.57, 3.14, 6.28)
_KNOWN = {
    "link": {"inertial", "visual", "collision"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller"},
    "inertial": {"origin", "mass", "inertia"},
}


def lint(file: RobotFile, robot: Robot) -> list[LintRemark]:
    """Remarks on a file and on its meaning, errors first."""
    format_remarks = _urdf(file, robot) if file.kind == "urdf" else _mjcf(file)
    remarks = [
        LintRemark(*noticed)
        for noticed in (*format_remarks, *_bodies(file, robot), *_joints(robot), *implausible(file, robot))
    ]
    return sorted(remarks, key=lambda remark: ("error", "warning", "note").index(remark.level))


def _bodies(file: RobotFile, robot: Robot) -> Iterator[_Noticed]:
    noun = "link" if file.kind == "urdf" else "body"
    for name, body in robot.bodies.items():
        place = f"{noun} {name}"
        if not np.any(body.inertia):
            continue
        if not body.mass:
            yield "error", place, "it has inertia but no mass; engines invent different masses"
        if body.impossible:
            yield "error", place, f"its inertia {body.impossible}; correct it: engines replace, refuse or accept it"
        elif body.moments[0] <= 0:
            yield "warning", place, "its inertia has a principal moment of zero; some engines refuse that"
    for joint in robot.moving:
        if robot.groups[joint.name].mass:
            continue
        if not any(robot.welded[follower.parent][0] == joint.name for follower in robot.moving):
            yield "error", f"joint {joint.name}", "it moves no mass: the mass matrix is singular"


def _joints(robot: Robot) -> Iterator[_Noticed]:
    for joint in robot.moving:
        place = f"joint {joint.name}"
        for name, value in (("damping", joint.damping), ("friction", joint.friction), ("armature", joint.armature)):
            if value < 0:
                yield "error", place, f"negative {name} {value:g}"
        if joint.lower is not None and joint.upper is not None and joint.lower > joint.upper:
            yield "error", place, f"lower limit {joint.lower:g} is above the upper one {joint.upper:g}"
    for name, what in (
        ("damping", "some engines leave it out of their dynamics"),
        ("friction", "engines leave it out or make it a soft constraint"),
        ("armature", "some engines leave it out of the mass matrix"),
        ("stiffness", "most engines leave springs out"),
    ):
        number = sum(bool(getattr(joint, name)) for joint in robot.moving)
        if number:
            yield "warning", "joints", f"{name} on {number} of {len(robot.moving)}: {what}"
    if robot.mimics:
        names = _some([mimic.joint for mimic in robot.mimics])
        yield "warning", "joints", f"{len(robot.mimics)} follow another (mimic): {names}; engines differ in that"


def _some(names: list[str]) -> str:
    return ", ".join(names[:3]) + (", …" if len(names) > 3 else "")


def _urdf(file: RobotFile, robot: Robot) -> Iterator[_Noticed]:
    bare = [name for name, source in robot.sources.items() if not source["inertial"]]
    carrying = [name for name in bare if robot.welded[name][0] in robot.columns]
    if carrying:
        names = _some(carrying)
        yield "warning", "links", f"{len(carrying)} without <inertial>: {names}; engines invent different masses"
    for name in (name for name in bare if robot.sources[name]["shapes"]):
        yield "warning", f"link {name}", "a collision shape without <inertial>: MuJoCo weighs it at 1000 kg/m³"
    for name, missing in incomplete_inertias(file.root).items():
        words = f"its <inertia> lacks {', '.join(missing)}, here 0; MuJoCo refuses that, Pinocchio 4.1.0 takes all as 0"
        yield "warning", f"link {name}", words
    for name, source in robot.sources.items():
        if source["inertial"] and np.any(source["frame"] != np.eye(3)):
            off = source["written"] - np.diag(np.diag(source["written"]))
            words = "together with products of inertia" if np.any(off) else "with principal moments"
            yield "note", f"link {name}", f"its inertial has rpy {words}, which MuJoCo 3.1.3 to 3.13.0 ignores"
    for element in file.root.iter():
        for child in element:
            if element.tag in _KNOWN and child.tag not in _KNOWN[element.tag]:
                place = f"{element.tag} {element.get('name', '')}".strip()
                yield "warning", place, f"the specification has no <{child.tag}> here"
    for joint in file.root.findall("joint"):
        yield from _urdf_joint(joint)


def _urdf_joint(joint: Element) -> Iterator[_Noticed]:
    place, kind = f"joint {joint.get('name')}", joint.get("type")
    axis, limit = joint.find("axis"), joint.find("limit")
    if axis is not None and kind not in {"fixed", "spherical"}:
        length = math.hypot(*numbers(axis, "xyz", "1 0 0", 3))
        if abs(length - 1) > _UNIT:
            yield "warning", place, f"its axis has length {length:.6g}, not 1"
    if kind == "spherical":
        yield "warning", place, "the specification has no spherical joints; few engines read them"
    if kind in {"revolute", "prismatic"} and limit is None:
        yield "warning", place, f"a {kind} joint needs <limit>; engines refuse it or take it as unlimited"
    if kind == "fixed" and joint.find("mimic") is not None:
        yield "warning", place, "a fixed joint cannot follow another; some engines refuse the file"


def _closed(file: RobotFile) -> Iterator[_Noticed]:
    """Constraints other than coupled joints."""
    parts = [item for part in file.root.iter("equality") for item in part if item.get("active") != "false"]
    closing = Counter(item.tag for item in parts if item.tag != "joint")
    if closing:
        kinds = ", ".join(f"{number} <{tag}>" for tag, number in closing.items())
        yield ("warning", "equality", f"{kinds}: the check compares the tree as if open; `run` and `compare` close it")


def _trees(parent: Element) -> int:
    """Number of bodies directly below the world, also within frames."""
    return len(parent.findall("body")) + sum(map(_trees, parent.findall("frame")))


def _mjcf(file: RobotFile) -> Iterator[_Noticed]:
    for compiler in file.root.iter("compiler"):
        for name, what in (
            ("settotalmass", "other engines ignore it"),
            ("balanceinertia", "it replaces impossible inertias silently"),
            ("boundmass", "it raises small masses"),
            ("boundinertia", "it raises small inertias"),
        ):
            if compiler.get(name) not in {None, "false", "0"}:
                yield "warning", "compiler", f"{name}: {what}"
    for option in file.root.iter("option"):
        if option.get("gravity"):
            yield "note", "option", f"gravity {option.get('gravity')}: some engines ignore it"
        for name in ("density", "viscosity"):
            if option.get(name) not in {None, "0"}:
                yield "note", "option", f"{name}: forces of the medium are not compared"
    yield from _closed(file)
    if next(file.root.iter("tendon"), None) is not None:
        yield "note", "tendon", "springs, damping and limits of tendons are not compared"
    if any(body.get("gravcomp") for body in file.root.iter("body")):
        yield "note", "bodies", "compensation of gravity (gravcomp) is not compared"
    if (trees := sum(map(_trees, file.root.iter("worldbody")))) > 1:
        yield "warning", "worldbody", f"{trees} trees: some engines keep only the first"
    for body in file.root.iter("body"):
        if len([*body.findall("joint"), *body.findall("freejoint")]) > 1:
            yield "note", "bodies", "several joints in one body: engines place them differently"
            return


def implausible(file: RobotFile, robot: Robot) -> Iterator[tuple[str, str, str]]:
    """Level, place and text of a remark on each implausible number."""
    noun = "link" if file.kind == "urdf" else "body"
    between = sum(float(np.linalg.norm(joint.position)) for joint in robot.joints if joint.kind != JointKind.FREE)
    for name, body in robot.bodies.items():
        if body.mass > 0:
            doubts = [*doubtful_body(body.mass, body.com, float(body.moments[-1]), between)]
            massive = f"it has a mass of {body.mass:.4g} kg but no inertia: some engines refuse it, others invent one"
            for what in doubts if np.any(body.inertia) else [*doubts, massive]:
                yield "warning", f"{noun} {name}", what
    for joint in robot.joints:
        away = float(np.linalg.norm(joint.position))
        if away > LARGE and joint.kind != JointKind.FREE:
            yield "warning", f"joint {joint.name}", f"it lies {away:.4g} m from its parent's origin; lengths are metres"
    yield from (_urdf_angles(file, robot) if file.kind == "urdf" else _mjcf_joints(file))


def _urdf_angles(file: RobotFile, robot: Robot) -> Iterator[tuple[str, str, str]]:
    for joint in robot.moving:
        limits = [abs(limit) for limit in (joint.lower, joint.upper) if limit is not None]
        if joint.kind == JointKind.REVOLUTE and limits and _TURNS[0] < max(limits) <= _TURNS[1]:
            words = f"a limit of {max(limits):g} rad are {max(limits) / 2 / math.pi:.1f} turns; angles are radians"
            yield "warning", f"joint {joint.name}", words
    for owner in (*file.root.findall("joint"), *file.root.findall("link")):
        for origin in owner.iter("origin"):
            turns = [abs(turn) for turn in floats(origin.get("rpy", "0"))]
            if max(turns) > _TURNS[0]:
                place = f"{owner.tag} {owner.get('name')}"
                yield "warning", place, f"rpy {origin.get('rpy')}: angles are radians"


def _mjcf_joints(file: RobotFile) -> Iterator[tuple[str, str, str]]:
    degrees = not any(compiler.get("angle") == "radian" for compiler in file.root.iter("compiler"))
    for joint, _, _, attributes in classed(file.root, "joint"):
        place = f"joint {joint.get('name')}"
        if attributes.get("type") == "free":
            laws = [name for name in _LAWS if name not in joint.attrib and any(floats(attributes.get(name, "0")))]
            if laws:
                words = f"it inherits {' and '.join(f'{law} {attributes[law]}' for law in laws)} from a default class"
                yield "warning", place, f"{words}, which acts on the flight of the body; write <freejoint/>"
        elif attributes.get("type", "hinge") == "hinge" and degrees and "range" in attributes:
            bounds = [abs(bound) for bound in floats(attributes["range"])]
            if any(abs(bound - angle) < 0.005 for bound in bounds for angle in _IN_RADIANS):
                words = f'range {attributes["range"]} is in degrees; radians need <compiler angle="radian"/>'
                yield "warning", place, words
