"""Causes that change masses and inertias: of the file, of its shapes, or of links joined by fixed joints."""

import copy
import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from proofroll.elements.mechanism.scene.rotations import about
from proofroll.robots.hypotheses import LEAST, WRITE_INERTIALS, RobotEvidence, hypothesis, with_weightless
from proofroll.robots.model import NO_BODY, Array, Robot, RobotBody, composed

# Bullet's margin around the box of a body's shapes, also if it has no shape [m].
_MARGIN = 1e-3
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


def _moments(inertia: Array) -> Array:
    """Principal moments, each at the index of the coordinate axis nearest to its own axis, shape (3,)."""
    from scipy.optimize import linear_sum_assignment  # a tenth of a second, which few checks need

    values, axes = np.linalg.eigh(inertia)
    _, order = linear_sum_assignment(-np.abs(axes))
    return np.asarray(values[order])


@hypothesis({"pybullet": "3.2.7 with URDF_MERGE_FIXED_LINKS"}, "load without URDF_MERGE_FIXED_LINKS")
def merged_at_link_origins(evidence: RobotEvidence) -> Robot:
    """Links at fixed joints are merged by their origins: inertial origins and rotations are dropped.

    Their principal moments are taken about the axes of the whole.
    """
    robot = evidence.robot
    bodies: list[RobotBody] = []
    for home in robot.columns:
        members = [(name, p, R) for name, (carrier, p, R) in robot.welded.items() if carrier == home]
        if len(members) == 1:
            continue
        for name, _, R in members:
            body = robot.bodies[name]
            written = np.array(robot.sources.get(name, {}).get("written", body.inertia))
            inertia = R.T @ np.diag(_moments(written)) @ R  # in the link's frame: diagonal in the axes of the composite
            bodies.append(dataclasses.replace(body, com=np.zeros(3), inertia=inertia))
    return robot.with_bodies(bodies)


# Off-diagonal element at which MuJoCo's Jacobi rotations end; moments that differ by less count as equal.
_SMALL = 1e-12


def _principal(inertia: Array) -> tuple[Array, Array]:
    """Principal moments, descending, shape (3,), and axes as columns, shape (3, 3), chosen as MuJoCo does."""
    axes = np.eye(3)
    for _ in range(500):
        turned = axes.T @ inertia @ axes
        off = {2: (0, 1), 1: (0, 2), 0: (1, 2)}
        axis = max(off, key=lambda axis: (abs(turned[off[axis]]), -axis))
        i, j = off[axis]
        if abs(turned[i, j]) < _SMALL:
            break
        tau = (turned[j, j] - turned[i, i]) / (2 * turned[i, j])
        tangent = (1 if tau >= 0 else -1) / (abs(tau) + np.hypot(1, tau))
        angle = np.arctan(tangent) * (1 if axis == 1 else -1)
        axes = axes @ about(axis, angle)
    moments = np.diag(axes.T @ inertia @ axes).copy()
    for column in (0, 1, 0):
        if moments[column] + _SMALL < moments[column + 1]:
            moments[[column, column + 1]] = moments[[column + 1, column]]
            axes = axes @ about((column + 2) % 3, np.pi / 2)
    return moments, axes


def _misplaced(evidence: RobotEvidence, *, turned: bool) -> Robot:
    """Robot with misplaced inertials of merged links, see :func:`merged_inertial_misplaced`.

    Principal axes are Q R if ``turned``, else Q.
    """
    robot, bodies = evidence.robot, []
    for joint in robot.joints:
        home, p, R = robot.welded[joint.child]
        body = robot.bodies[joint.child]
        if joint.dofs or home == NO_BODY or not body.mass:
            continue
        source = robot.sources.get(joint.child, {})
        moments, Q = _principal(np.array(source.get("written", body.inertia)))
        # c + Q p and axes Q R are in the frame of the moving link; here they are transformed to the merged link's own
        axes, com = R.T @ (Q @ R if turned else Q), R.T @ (body.com + Q @ p - p)
        bodies.append(dataclasses.replace(body, com=com, inertia=axes @ np.diag(moments) @ axes.T))
    return robot.with_bodies(bodies)


@hypothesis(
    {"mujoco": "3.8.1 to 3.10.0"}, 'update MuJoCo, or put <mujoco><compiler fusestatic="false"/></mujoco> into the file'
)
def merged_inertial_misplaced(evidence: RobotEvidence) -> Robot:
    """The inertial of a merged link is placed in the wrong order (default fusestatic for URDF).

    The pose (p, R) of the link in its parent and the pose (c, Q) of its principal frame in the link are multiplied as
    (c, Q) (p, R): the centre of mass comes to lie at c + Q p instead of p + R c. The principal frame is MuJoCo's:
    Jacobi rotations from the axes of the link, then moments in descending order; its rpy is ignored, as in these
    versions.
    """
    return _misplaced(evidence, turned=True)


@hypothesis({"mujoco": "3.3.3"}, 'update MuJoCo, or put <mujoco><compiler fusestatic="false"/></mujoco> into the file')
def merged_inertial_misplaced_unturned(evidence: RobotEvidence) -> Robot:
    """The inertial of a merged link is placed in the wrong order and not turned (default fusestatic for URDF)."""
    return _misplaced(evidence, turned=False)


def _half(kind: str, sizes: dict[str, str]) -> Array | None:
    """Half lengths of a shape's bounding box [m], shape (3,); None: the kind of shape is not covered."""
    name, count, part = {"box": ("size", 3, 0.5), "sphere": ("radius", 1, 1.0)}.get(kind, ("", 0, 0.0))
    try:
        lengths = [part * float(length) for length in sizes.get(name, "").split()]
    except ValueError:
        return None
    return np.full(3, lengths) if count and len(lengths) == count else None


def _box(mass: float, shapes: list[Any], com: Array, frame: Array) -> Array | None:
    """Principal moments of the box around all shapes, in the inertial's axes [kg m²], shape (3,).

    None: a shape is not covered.
    """
    low, high = (np.full(3, np.inf), np.full(3, -np.inf)) if shapes else (np.zeros(3), np.zeros(3))
    for kind, sizes, position, rotation in shapes:
        half = _half(kind, sizes)
        if half is None:
            return None
        centre, reach = frame.T @ (position - com), np.abs(frame.T @ rotation) @ half
        reach = reach if kind == "box" else half
        low, high = np.minimum(low, centre - reach), np.maximum(high, centre + reach)
    x, y, z = (high - low + 2 * _MARGIN) ** 2
    return mass / 12 * np.array([y + z, x + z, x + y])


@hypothesis({"pybullet": "default of 3.2.7"}, "load with flags=URDF_USE_INERTIA_FROM_FILE")
def inertia_from_collision(evidence: RobotEvidence) -> Robot | None:
    """Inertias are computed from collision shapes, not taken from the file.

    Inertias are those of a box around the shapes, in the axes of the file's inertial.
    """
    robot, bodies = evidence.robot, []
    for name, source in robot.sources.items():
        body = robot.bodies.get(name)
        if body is None or not source.get("inertial") or not body.mass:
            continue
        moments = _box(body.mass, source["shapes"], body.com, source["frame"])
        if moments is None:
            return None
        frame = source["frame"]
        bodies.append(dataclasses.replace(body, inertia=frame @ np.diag(moments) @ frame.T))
    return robot.with_bodies(bodies)


@hypothesis({"pinocchio": "4.1.0"}, WRITE_INERTIALS)
def noncolliding_shapes_weightless(evidence: RobotEvidence) -> Robot | None:
    """Shapes that collide with nothing (contype 0, conaffinity 0) give no mass."""
    sources = evidence.robot.sources

    def edit(root: Element) -> bool:
        touched = False
        for body in root.iter("body"):
            shapes = body.findall("geom")
            collides = sources.get(str(body.get("name")), {}).get("collides", [])
            if len(shapes) != len(collides) or all(collides):
                continue
            touched = True
            for shape, hits in zip(shapes, collides, strict=True):
                if not hits:
                    body.remove(shape)
        bounded_from_below(root, replace=False)
        return touched

    return evidence.edited(edit)


_DENSITY = 1000.0


def _solid(kind: str, sizes: Mapping[str, str]) -> tuple[float, Array] | None:
    """Mass [kg] and principal moments [kg m²] of a shape at 1000 kg/m³; None: the kind of shape is not covered."""
    if kind == "box":
        x, y, z = (float(part) for part in sizes["size"].split())
        m = _DENSITY * x * y * z
        return m, m / 12 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    if kind == "sphere":
        r = float(sizes["radius"])
        m = _DENSITY * 4 / 3 * math.pi * r**3
        return m, np.full(3, 0.4 * m * r * r)
    if kind == "cylinder":
        r, length = float(sizes["radius"]), float(sizes["length"])
        m = _DENSITY * math.pi * r * r * length
        across = m * (r * r / 4 + length * length / 12)
        return m, np.array([across, across, m * r * r / 2])
    return None


def _weighed(name: str, shapes: list[Any]) -> RobotBody | None:
    parts = []
    for kind, sizes, position, rotation in shapes:
        solid = _solid(kind, sizes)
        if solid is None:
            return None
        mass, moments = solid
        parts.append((RobotBody("", mass, np.zeros(3), np.diag(moments)), np.array(position), np.array(rotation)))
    return composed(name, parts) if parts else None


@hypothesis({"mujoco": "all versions so far"}, "give every link an <inertial>")
def shapes_weighed(evidence: RobotEvidence) -> Robot:
    """Collision shapes of links without <inertial> are weighed at 1000 kg/m³."""
    robot = evidence.robot
    bare = {name: source["shapes"] for name, source in robot.sources.items() if not source.get("inertial", True)}
    return robot.with_bodies(filter(None, itertools.starmap(_weighed, bare.items())))


@hypothesis({"pybullet": "3.2.7"}, "give every link an <inertial>; a massless one with mass 0 and inertia 0")
def unit_mass_without_inertial(evidence: RobotEvidence) -> Robot:
    """Links without <inertial> are given 1 kg and unit inertia."""
    robot = evidence.robot
    bare = (name for name, source in robot.sources.items() if name in robot.bodies and not source.get("inertial", True))
    return robot.with_bodies(RobotBody(name, 1.0, np.zeros(3), np.eye(3)) for name in bare)
