"""Causes that change masses and inertias given in the file: impossible, small, rotated or scaled ones."""

import copy
import dataclasses
from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from proofroll.robots.hypotheses import LEAST, WRITE_INERTIALS, RobotEvidence, hypothesis, with_weightless
from proofroll.robots.model import Array, Robot, RobotBody

# Attributes of the <inertia> of a URDF; its specification requires all.
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def incomplete_inertias(root: Element) -> dict[str, list[str]]:
    """Links of a URDF whose <inertia> lacks attributes, each with those that it lacks."""
    lacking = {
        str(link.get("name")): [name for name in _MOMENTS if moments.get(name) is None]
        for link in root.findall("link")
        for moments in link.findall("inertial/inertia")
    }
    return {name: missing for name, missing in lacking.items() if missing}


@hypothesis({"pinocchio": "4.1.0"}, "write all of ixx, ixy, ixz, iyy, iyz, izz, also those that are zero")
def incomplete_inertia_zeroed(evidence: RobotEvidence) -> Robot:
    """An <inertia> that lacks one of its six attributes is read as zero."""
    bodies = evidence.robot.bodies
    names = (name for name in incomplete_inertias(evidence.root) if name in bodies and np.any(bodies[name].inertia))
    return evidence.robot.with_bodies(dataclasses.replace(bodies[name], inertia=np.zeros((3, 3))) for name in names)


def _suspects(evidence: RobotEvidence) -> Iterator[RobotBody]:
    """Bodies whose inertia differs in the engine and may count as impossible there, by whatever rule.

    One that is written incompletely is possible as far as it is known.
    """
    robot, reading, incomplete = evidence.robot, evidence.reading, incomplete_inertias(evidence.root)
    scale = max((float(np.abs(group.inertia).max()) for group in robot.groups.values()), default=1.0)
    unlike = {
        name
        for name, group in robot.groups.items()
        if name in reading.inertia and np.abs(reading.inertia[name] - group.inertia).max() > 1e-10 * scale
    }
    for name, (home, _, _) in robot.welded.items():
        body = robot.bodies.get(name)
        alone = sum(carrier == home for carrier, _, _ in robot.welded.values()) == 1
        if body is not None and home in unlike:
            impossible = body.breaks_triangle or body.moments[0] <= 0
            suspect = alone or (impossible and np.any(body.inertia)) or (not body.mass and np.any(body.inertia))
            if suspect and (impossible or name not in incomplete):
                yield body


def _replaced(evidence: RobotEvidence, instead: Callable[[RobotBody], RobotBody]) -> Robot:
    """Robot with ``instead(body)`` for each suspect body (see :func:`_suspects`)."""
    return evidence.robot.with_bodies(map(instead, _suspects(evidence)))


@hypothesis({"pybullet": "3.2.7", "mujoco": "4.0.0 (of a link without mass)"}, "correct the inertia in the file")
def impossible_inertia_zeroed(evidence: RobotEvidence) -> Robot:
    """An impossible inertia is replaced by zero."""
    return _replaced(evidence, lambda body: dataclasses.replace(body, inertia=np.zeros((3, 3))))


@hypothesis({"mujoco": "with balanceinertia"}, "correct the inertia in the file, and leave balanceinertia out")
def inertia_balanced(evidence: RobotEvidence) -> Robot:
    """An impossible inertia is replaced by a sphere with the mean of its principal moments."""
    return _replaced(evidence, lambda body: dataclasses.replace(body, inertia=np.trace(body.inertia) / 3 * np.eye(3)))


# Density of water [kg/m³].
_WATER = 1000.0


def _sphere_of_water(body: RobotBody) -> RobotBody:
    mass = body.mass or 1.0
    radius = (3 * mass / (4 * np.pi * _WATER)) ** (1 / 3)
    return dataclasses.replace(body, mass=mass, inertia=0.4 * mass * radius**2 * np.eye(3))


@hypothesis({"drake": "1.51.1 (a line of its log says so)"}, "correct the inertia in the file")
def water_sphere(evidence: RobotEvidence) -> Robot:
    """An impossible inertia is replaced by that of a sphere of water (of 1 kg where the mass is 0)."""
    return _replaced(evidence, _sphere_of_water)


_BOUNDS = ("boundmass", "boundinertia")  # attributes of <compiler>

# Usual values of boundmass and boundinertia for URDF in MuJoCo, which our option sets too [kg], [kg m²].
_MASS, _MOMENT = 1e-6, 1e-8


def _raised(body: RobotBody, com: Array) -> RobotBody:
    values, axes = np.linalg.eigh(body.inertia)
    bounded = axes @ np.diag(np.maximum(values, _MOMENT)) @ axes.T
    return dataclasses.replace(body, mass=max(body.mass, _MASS), com=com, inertia=bounded)


@hypothesis({"mujoco": "with boundmass, boundinertia"}, "leave the bounds out, or correct the masses in the file")
def mass_bounded(evidence: RobotEvidence) -> Robot:
    """Small masses and inertias are raised to a bound (1e-6 kg, 1e-8 kg m²)."""
    robot = evidence.robot
    small = []
    for joint in robot.joints:
        body = robot.bodies[joint.child]
        if body.mass < _MASS or np.linalg.eigvalsh(body.inertia)[0] < _MOMENT:
            # MuJoCo 4.0.0 puts the centre of mass of a link without <inertial> where its frame is in the parent's
            has_inertial = robot.sources.get(body.name, {}).get("inertial", True)
            small.append(_raised(body, body.com if has_inertial else joint.position))
    return robot.with_bodies(small)


def bounded_from_below(root: Element, *, replace: bool) -> None:
    """Writes bounds of almost zero, with which massless bodies compile; ``replace``: also over bounds of the file."""
    compilers = list(root.iter("compiler")) or [SubElement(root, "compiler")]
    for name in _BOUNDS:
        if replace or not any(float(compiler.get(name) or 0) for compiler in compilers):
            for compiler in compilers:
                compiler.set(name, str(LEAST))


@hypothesis({"pinocchio": "4.1.0"}, WRITE_INERTIALS)
def bounds_ignored(evidence: RobotEvidence) -> Robot | None:
    """Bounds on masses and inertias (boundmass, boundinertia) are ignored where a body has no <inertial>."""
    root = copy.deepcopy(evidence.root)
    bounded_from_below(root, replace=True)
    old, lowered = evidence.recompiled(evidence.root), evidence.recompiled(root)
    if old is None or lowered is None:
        return None
    with_inertial = {str(body.get("name")) for body in root.iter("body") if body.find("inertial") is not None}
    bare = (body for name, body in lowered.bodies.items() if name not in with_inertial)
    return evidence.carried_over(old, with_weightless(old.with_bodies(bare)))


@hypothesis({"mujoco": "3.1.3 to 3.13.0"}, "update the engine, or write the inertia in the axes of the link with rpy 0")
def inertial_rotation_ignored(evidence: RobotEvidence) -> Robot:
    """The rpy of <inertial> is ignored.

    The moments are taken in the axes of the link.
    """
    robot = evidence.robot
    return robot.with_bodies(
        dataclasses.replace(robot.bodies[name], inertia=np.array(source["written"]))
        for name, source in robot.sources.items()
        if name in robot.bodies and "written" in source and np.any(np.array(source["frame"]) != np.eye(3))
    )


@hypothesis(
    {"pinocchio": "4.1.0", "drake": "1.51.1"},
    "compile the file once with MuJoCo, save it (mj_saveLastXML, six digits), and give others the saved file",
)
def total_mass_ignored(evidence: RobotEvidence) -> Robot | None:
    """Settotalmass is ignored: masses are as written."""
    robot, masses = evidence.robot, evidence.reading.mass
    if not any(compiler.get("settotalmass") for compiler in evidence.file.root.iter("compiler")):
        return None
    scaled = sum(group.mass for name, group in robot.groups.items() if name in masses)
    if not scaled:
        return None
    factor = sum(mass for name, mass in masses.items() if name in robot.groups) / scaled
    return robot.with_bodies(
        dataclasses.replace(body, mass=factor * body.mass, inertia=factor * body.inertia)
        for body in robot.bodies.values()
    )
