"""Causes in which an importer of MJCF ignores or misreads an attribute."""

import copy
import dataclasses
from collections.abc import Iterable
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.robots.files.mjcf.defaults import with_classes
from proofroll.robots.hypotheses import WRITE_INERTIALS, RobotEvidence, hypothesis
from proofroll.robots.model import Robot, RobotBody
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


def _inertials(root: Element) -> list[tuple[str, Element]]:
    return [(str(body.get("name")), inertial) for body in root.iter("body") for inertial in body.findall("inertial")]


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
    for name, inertial in _inertials(root):
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
        effective = {id(geom): attributes for geom, attributes in with_classes(root, "geom")}
        touched = False
        for body in root.iter("body"):
            shapes = body.findall("geom")
            hits = collides.get(str(body.get("name")), [])
            for shape, weighs in zip(shapes, hits if len(hits) == len(shapes) else [True] * len(shapes), strict=True):
                classed = effective[id(shape)]
                if weighs and (classed.get("type") == "mesh" or classed.get("mesh")):
                    _without([shape], "mesh", "density", "shellinertia")
                    shape.attrib |= {"type": "sphere", "size": repr(_UNIT_BALL), "mass": "1"}
                    touched = True
        _without(_defaults(root, "geom"), "mesh")
        return touched

    return evidence.edited(edit)
