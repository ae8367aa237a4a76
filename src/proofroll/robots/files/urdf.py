"""Our own reading of URDF, strictly by its specification (wiki.ros.org/urdf/XML), with no values invented."""

import copy
import math
from collections import Counter
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.core.errors import InputError, choices, error_location
from proofroll.elements.mechanism.scene.joint_kinds import ONE_COORDINATE, JointKind
from proofroll.elements.mechanism.scene.rotations import from_rpy
from proofroll.robots.files.robot_file import LintRemark, RobotFile, numbers
from proofroll.robots.model import DOFS, NO_BODY, Array, Mimic, Robot, RobotBody, RobotJoint

# Name of the joint between the world and the root link.
BASE_JOINT = "(base)"
# Kind in a URDF -> kind of a joint here. ``spherical`` is not in the specification, but Bullet and MuJoCo read it.
_KINDS = {
    "revolute": JointKind.REVOLUTE,
    "prismatic": JointKind.PRISMATIC,
    "fixed": JointKind.FIXED,
    "spherical": JointKind.SPHERICAL,
    "continuous": JointKind.REVOLUTE,
}
_MOMENTS = ("xx", "xy", "xz", "yy", "yz", "zz")
_PRIMITIVES = {"box", "sphere", "cylinder", "capsule"}


def neutral_urdf(root: Element) -> tuple[Element, list[LintRemark]]:
    """Copy of a URDF without meshes, looks and options for single programs, and remarks on omissions."""
    root, remarks = copy.deepcopy(root), []
    for child in list(root):
        if child.tag not in {"link", "joint"}:
            root.remove(child)
            if child.tag in {"gazebo", "mujoco", "transmission", "drake:proximity_properties"}:
                remarks.append(LintRemark("note", child.tag, "options for one program; left out for every engine"))
            elif child.tag not in {"material", "group_state", "link_state"}:
                remarks.append(LintRemark("warning", str(child.tag), "the specification has no such element; left out"))
    for joint in root.iter("joint"):
        for key in extra_dynamics(joint):
            words = "the specification has no such attribute; left out for every engine"
            remarks.append(LintRemark("warning", f"joint {joint.get('name')} {key}", words))
    meshes = 0
    for link in root.iter("link"):
        removed = 0
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            geometry = shape.find("geometry")
            drawn = geometry is None or not any(part.tag in _PRIMITIVES for part in geometry)
            if drawn or shape.tag == "visual":
                link.remove(shape)
                removed += drawn and shape.tag == "collision"
        meshes += removed
        if removed and link.find("inertial") is None:
            words = (
                "its collision mesh was left out, and it has no <inertial>: engines that weigh shapes find less mass"
            )
            remarks.append(LintRemark("warning", f"link {link.get('name')}", words))
    if meshes:
        words = f"{meshes} collision meshes left out for every engine: masses come from <inertial> alone"
        remarks.append(LintRemark("note", "links", words))
    return root, remarks


def extra_dynamics(joint: Element) -> list[str]:
    """Attributes of the dynamics of a URDF's joint that the specification lacks, as springStiffness, but zeros."""
    attributes = [item for dynamics in joint.findall("dynamics") for item in dynamics.attrib.items()]
    return [key for key, value in attributes if key not in {"damping", "friction"} and value.strip("0. ")]


def transmissions(root: Element) -> tuple[dict[str, float], dict[str, float]]:
    """Joints to which the transmissions of a URDF lead, with their reductions, and with the inertia of their rotors.

    A reduction is 1 where none can be read. Inertias are reflected by Drake's gear ratio [kg m² or kg]; only joints
    with rotors have one.

    Raises:
        InputError: an inertia or a ratio is no number, or negative.
    """
    reductions: dict[str, float] = {}
    inertias: dict[str, float] = {}
    for item in root.findall("transmission"):
        inertia, ratio = _of_actuator(item, "rotor_inertia", "0"), _of_actuator(item, "gear_ratio", "1")
        for joint in item.findall("joint"):
            if name := joint.get("name"):
                reductions[name] = next((number for number in map(_reduction, item.iter("mechanicalReduction"))), 1.0)
                inertias[name] = inertias.get(name, 0.0) + inertia * ratio**2
    return reductions, {name: inertia for name, inertia in inertias.items() if inertia}


def _of_actuator(transmission: Element, key: str, default: str) -> float:
    """Number in an element of Drake's below the actuator of a transmission."""
    elements = (item for item in transmission.iter() if str(item.tag).rpartition("}")[2] in {key, f"drake:{key}"})
    value = next((numbers(item, "value", default, 1)[0] for item in elements), float(default))
    if value < 0:
        raise InputError(f"<drake:{key} value>", value, "it must be at least 0")
    return value


def _reduction(element: Element) -> float:
    try:
        return float(element.text or "") or 1.0
    except ValueError:
        return 1.0


def rename_world(root: Element) -> None:
    """Renames a root link called ``world``: some engines fix such a link to the ground."""
    carried = {child.get("link") for joint in root.iter("joint") for child in joint.findall("child")}
    taken = {link.get("name") for link in root.iter("link")}
    if "world" in taken - carried:
        name = next(name for number in range(len(taken) + 1) if (name := "world_link" + "_" * number) not in taken)
        for link in root.findall("link"):
            if link.get("name") == "world":
                link.set("name", name)
        for parent in (parent for joint in root.iter("joint") for parent in joint.findall("parent")):
            if parent.get("link") == "world":
                parent.set("link", name)


def read_urdf(file: RobotFile) -> Robot:
    """Robot of a URDF.

    Raises:
        InputError: the file violates the specification so that it has no meaning, or has a planar or floating joint.
    """
    with error_location(str(file.path)):
        return _robot(file)


def _robot(file: RobotFile) -> Robot:
    links = _named(file.root, "link")
    elements = _named(file.root, "joint")
    if not links:
        raise InputError("file", file.path, "it has no links")
    bodies, sources = {}, {}
    for name, link in links.items():
        with error_location(f"<link {name}>"):
            bodies[name], sources[name] = _body(name, link)
    joints = []
    for name, element in elements.items():
        with error_location(f"<joint {name}>"):
            joints.append(_joint(name, element, links))
    mimics = [
        Mimic(name, mimic.get("joint", ""), *(numbers(mimic, key, value, 1)[0] for key, value in _RATIO))
        for name, element in elements.items()
        if (mimic := element.find("mimic")) is not None and element.get("type") != "fixed"
    ]
    robot = Robot(str(file.root.get("name", "robot")), bodies, _ordered(joints, links, file.base), sources=sources)
    return robot.change(mimics=_direct(mimics, robot))


_RATIO = (("multiplier", "1"), ("offset", "0"))


def _named(root: Element, tag: str) -> dict[str, Element]:
    elements = root.findall(tag)
    for name, times in Counter(element.get("name") for element in elements).items():
        if not name:
            raise InputError(f"<{tag} name>", name, f"every {tag} needs a name")
        if times > 1:
            raise InputError(f"<{tag} name>", name, f"{times} {tag}s have this name")
    return {str(element.get("name")): element for element in elements}


def _origin(element: Element) -> tuple[Array, Array]:
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), np.eye(3)
    angles = numbers(origin, "rpy", "0 0 0", 3)
    return np.array(numbers(origin, "xyz", "0 0 0", 3)), from_rpy(angles)


def _body(name: str, link: Element) -> tuple[RobotBody, dict[str, Any]]:
    shapes = []
    for collision in link.findall("collision"):
        geometry = collision.find("geometry")
        if geometry is not None and len(geometry):
            shapes.append((geometry[0].tag, dict(geometry[0].attrib), *_origin(collision)))
    inertial = link.find("inertial")
    source: dict[str, Any] = {"inertial": inertial is not None, "shapes": shapes}
    if inertial is None:
        return RobotBody(name, 0.0, np.zeros(3), np.zeros((3, 3))), source
    com, R = _origin(inertial)
    mass = inertial.find("mass")
    m = 0.0 if mass is None else numbers(mass, "value", None, 1)[0]
    if m < 0:
        raise InputError("mass", m, "no body has a negative mass; correct it")
    written = np.zeros((3, 3))
    moments = inertial.find("inertia")
    if moments is not None:
        xx, xy, xz, yy, yz, zz = (numbers(moments, f"i{key}", "0", 1)[0] for key in _MOMENTS)
        written = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    source |= {"written": written, "frame": R}
    return RobotBody(name, m, com, R @ written @ R.T), source


def _joint(name: str, element: Element, links: dict[str, Element]) -> RobotJoint:
    kind = _KINDS.get(element.get("type", ""))
    if kind is None:
        kinds = ", ".join(_KINDS)
        raise InputError("type", element.get("type"), f"the check covers {kinds}")
    ends = {}
    for end in ("parent", "child"):
        end_element = element.find(end)
        ends[end] = "" if end_element is None else end_element.get("link", "")
        if ends[end] not in links:
            raise InputError(end, ends[end], "there is no such link")
    position, rotation = _origin(element)
    axis = np.array([1.0, 0.0, 0.0])
    if DOFS[kind] == 1 and (end_element := element.find("axis")) is not None:
        axis = np.array(numbers(end_element, "xyz", "1 0 0", 3))
    length = math.hypot(*axis)
    if not length:
        raise InputError("axis", axis.tolist(), "an axis needs a direction; give one of length 1")
    dynamics = element.find("dynamics")
    limit = element.find("limit")
    bounded = limit is not None and element.get("type") in {"revolute", "prismatic"}
    return RobotJoint(
        name=name, kind=kind, parent=ends["parent"], child=ends["child"], position=position, rotation=rotation,
        axis=axis / length,
        damping=0.0 if dynamics is None or kind == JointKind.FIXED else numbers(dynamics, "damping", "0", 1)[0],
        friction=0.0 if dynamics is None or kind == JointKind.FIXED else numbers(dynamics, "friction", "0", 1)[0],
        lower=numbers(limit, "lower", "0", 1)[0] if bounded and limit is not None else None,
        upper=numbers(limit, "upper", "0", 1)[0] if bounded and limit is not None else None,
        effort=_of_drive(limit, "effort"),
        speed=_of_drive(limit, "velocity"),
    )  # fmt: skip


def _of_drive(limit: Element | None, key: str) -> float | None:
    """Largest effort or velocity of a drive; None: none, or 0, which files write where they know none."""
    return None if limit is None else numbers(limit, key, "0", 1)[0] or None


def _ordered(joints: list[RobotJoint], links: dict[str, Element], base: str) -> tuple[RobotJoint, ...]:
    """Joints, parents first, starting with the one that carries the root link.

    Raises:
        InputError: the links do not form a tree with one root.
    """
    carried = Counter(joint.child for joint in joints)
    for name, times in carried.items():
        if times > 1:
            raise InputError("<child link>", name, f"{times} joints carry this link; a URDF is a tree")
    roots = [name for name in links if name not in carried]
    if len(roots) != 1:
        message = (
            "its links form a loop" if not roots else f"it has {len(roots)} roots, {roots[0]} and {roots[1]} among them"
        )
        raise InputError("<robot>", roots[0] if roots else "", f"{message}; a URDF is a tree with one root")
    below: dict[str, list[RobotJoint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    kind = JointKind.FREE if base == "free" else JointKind.FIXED
    parents_first = [
        RobotJoint(
            name=BASE_JOINT,
            kind=kind,
            parent=NO_BODY,
            child=roots[0],
            position=np.zeros(3),
            rotation=np.eye(3),
            axis=np.array([0.0, 0.0, 1.0]),
        )
    ]
    waiting = list(reversed(below.get(roots[0], [])))
    while waiting:
        parents_first.append(waiting.pop())
        waiting += reversed(below.get(parents_first[-1].child, []))
    if len(parents_first) != len(links):
        raise InputError("<robot>", roots[0], "some links form a loop; a URDF is a tree with one root")
    return tuple(parents_first)


def _direct(mimics: list[Mimic], robot: Robot) -> tuple[Mimic, ...]:
    """Mimics in which chains are resolved: every follower refers to a joint that follows none.

    Raises:
        InputError: a mimic names no joint, or followers form a cycle.
    """
    by_joint = {mimic.joint: mimic for mimic in mimics}
    kinds = {joint.name: joint.kind for joint in robot.moving}
    resolved = []
    for mimic in mimics:
        factor, offset, leader, seen = mimic.multiplier, mimic.offset, mimic.other, {mimic.joint}
        while leader in by_joint and leader not in seen:
            seen.add(leader)
            following = by_joint[leader]
            factor, offset, leader = factor * following.multiplier, offset + factor * following.offset, following.other
        if leader not in {joint.name for joint in robot.joints}:
            meant = [name for name in kinds if name != mimic.joint and name.endswith(leader)]
            advice = f"; name the one that is meant, {choices(meant)}" if meant else "; name one that moves"
            raise InputError(f"<joint {mimic.joint} mimic>", leader, f"the file has no joint of this name{advice}")
        if leader in seen or kinds.get(leader) not in ONE_COORDINATE:
            raise InputError(f"<joint {mimic.joint} mimic>", mimic.other, "name another joint that moves")
        resolved.append(Mimic(mimic.joint, leader, factor, offset))
    return tuple(resolved)
