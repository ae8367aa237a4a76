"""Remarks on implausible numbers of a robot file: most often a wrong unit, or an unintended default."""

import math
from collections.abc import Iterator

import numpy as np

from proofroll.elements.mechanism.run.plausibility import LARGE, doubtful_body
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.robots.files.mjcf.defaults import with_classes
from proofroll.robots.files.robot_file import RobotFile, floats
from proofroll.robots.model import Robot, RobotBody

# Limits of an angle between these are probably degrees [rad]: joints turn twice at most, and larger numbers mean none.
_TURNS = 4 * math.pi, 720.0
# Attributes with which a free joint is damped, loaded or held like any other joint.
_LAWS = ("damping", "armature", "frictionloss", "stiffness")
# Common angles in radians, by which a range in the wrong unit is recognised where degrees are read.
_IN_RADIANS = (1.57, 3.14, 6.28)


def implausible(file: RobotFile, robot: Robot) -> Iterator[tuple[str, str, str]]:
    """Level, place and text of a remark on each implausible number."""
    noun = "link" if file.kind == "urdf" else "body"
    between = sum(float(np.linalg.norm(joint.position)) for joint in robot.joints if joint.kind != JointKind.FREE)
    for name, body in robot.bodies.items():
        for what in _body(body, between):
            yield "warning", f"{noun} {name}", what
    for joint in robot.joints:
        away = float(np.linalg.norm(joint.position))
        if away > LARGE and joint.kind != JointKind.FREE:
            yield "warning", f"joint {joint.name}", f"it lies {away:.4g} m from its parent's origin; lengths are metres"
    yield from (_urdf_angles(file, robot) if file.kind == "urdf" else _mjcf_joints(file))


def _body(body: RobotBody, between: float) -> Iterator[str]:
    if body.mass > 0:
        yield from doubtful_body(body.mass, body.com, float(body.moments[-1]), between)
        if not np.any(body.inertia):
            yield f"it has a mass of {body.mass:.4g} kg but no inertia: some engines refuse it, others invent one"


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
    for joint, attributes in with_classes(file.root, "joint"):
        place = f"joint {joint.get('name')}"
        if attributes.get("type") == "free":
            laws = [name for name in _LAWS if name not in joint.attrib and any(floats(attributes.get(name, "0")))]
            if laws:
                words = f"it inherits {' and '.join(f'{law} {attributes[law]}' for law in laws)} from a default class"
                yield "warning", place, f"{words}, which acts on the flight of the body; write <freejoint/>"
        elif attributes.get("type", "hinge") == "hinge" and degrees and "range" in attributes:
            bounds = [abs(bound) for bound in floats(attributes["range"])]
            if any(abs(bound - angle) < 0.005 for bound in bounds for angle in _IN_RADIANS):
                yield (
                    "warning",
                    place,
                    f'range {attributes["range"]} is in degrees; radians need <compiler angle="radian"/>',
                )
