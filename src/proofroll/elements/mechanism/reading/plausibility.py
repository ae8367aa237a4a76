"""Remarks on numbers of a scene that are probably in another unit: degrees, millimetres, g mm²."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.bounds import DENSEST, LIGHTEST
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import TURNING, JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Body
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry

# Length above which a wrong unit is likelier than a machine of that size [m].
LARGE = 10.0
# Largest plausible distance of a centre of mass from its origin: the larger of this [m] and this many times the sum of
# the distances between joints.
FAR, TIMES = 1.0, 10.0
# Angles between these are probably degrees [rad]; larger ones are meant.
_TURN, _MOST = 2 * math.pi, 720.0
_METRES, _RADIANS = "lengths are metres", "angles are radians, or written as '30 deg'"


def implausible(mechanism: Mechanism) -> list[str]:
    """Sentences on implausible numbers, each with the name of its part."""
    between = sum(
        float(np.linalg.norm(part)) for joint in mechanism.joints for part in (joint.position, joint.child_position)
    )
    sentences = [f"joint {joint.name}: {what}" for joint in mechanism.joints for what in _joint(joint)]
    for body in mechanism.bodies:
        shapes = [shape for shape in mechanism.geometries if shape.body == body.name]
        sentences += [f"body {body.name}: {what}" for what in (*_body(body, between), *_density(body, shapes))]
    sentences += [f"geometry {shape.name}: {what}" for shape in mechanism.geometries for what in _shape(shape)]
    return sentences


def _joint(joint: Joint) -> Iterator[str]:
    away = float(np.linalg.norm(joint.position))
    if away > LARGE:
        yield f"it lies {away:.4g} m from its parent's origin; {_METRES}"
    angles = [*joint.orientation, *(joint.q0 if joint.kind in TURNING else joint.q0[2:3])]
    if joint.kind in {JointKind.PRISMATIC, JointKind.SPHERICAL, JointKind.FREE}:
        angles = [*joint.orientation]
    if joint.kind == JointKind.REVOLUTE:
        angles += [limit for limit in joint.limits or () if abs(limit) > 2 * _TURN]
    largest = max(map(abs, angles), default=0.0)
    if _TURN < largest <= _MOST:
        yield f"an angle of {largest:.4g} rad is {largest / _TURN:.1f} turns; {_RADIANS}"


def _body(body: Body, between: float) -> Iterator[str]:
    if body.mass > 0:
        moments = np.linalg.eigvalsh(np.array(body.inertia))
        yield from doubtful_body(body.mass, np.array(body.com), float(moments[-1]), between, least=0.1)


def doubtful_body(mass: float, com: FloatArray, largest: float, between: float, least: float = 1.0) -> Iterator[str]:
    """Sentences on a centre of mass and a moment of inertia that are probably in another unit.

    Args:
        mass: [kg].
        com: centre of mass from the body's origin [m].
        largest: moment of inertia [kg m²].
        between: sum of the distances between joints [m].
        least: smallest plausible radius of gyration, in parts of that of a ball of osmium.
    """
    away = float(np.linalg.norm(com))
    if away > LARGE or (between and away > max(FAR, TIMES * between)):
        yield f"its centre of mass lies {away:.4g} m from its origin; {_METRES}"
    if not largest > 0:
        return
    gyration = math.sqrt(largest / mass)
    smallest = math.sqrt(0.4) * (3 * mass / (4 * math.pi * DENSEST)) ** (1 / 3)
    if gyration > LARGE:
        yield f"its radius of gyration is {gyration:.4g} m; inertias are kg m²: 1 g mm² is 1e-9, 1 kg mm² is 1e-6"
    elif gyration < least * smallest:
        size = f"its radius of gyration of {1e3 * gyration:.4g} mm"
        yield f"{size} is that of {mass:.4g} kg denser than osmium; inertias are kg m²"


def _volume(shape: Geometry) -> float:
    if shape.kind == "box" and shape.size is not None:
        return math.prod(shape.size)
    if shape.kind == "ellipsoid" and shape.axes is not None:
        return 4 / 3 * math.pi * math.prod(shape.axes)
    if shape.length is not None:
        caps = 4 / 3 * math.pi * (shape.radius or 0.0) ** 3 if shape.kind == "capsule" else 0.0
        return caps + math.pi * (shape.radius or 0.0) ** 2 * shape.length
    return 4 / 3 * math.pi * (shape.radius or 0.0) ** 3 if shape.kind == "sphere" else 0.0


def _density(body: Body, shapes: list[Geometry]) -> Iterator[str]:
    volume = max(map(_volume, shapes), default=0.0)
    if not volume or not body.mass > 0:
        return
    density = f"{body.mass:.4g} kg in {volume:.3g} m³ are {body.mass / volume:.2g} kg/m³"
    if body.mass < LIGHTEST * volume:
        yield f"{density}, less than any solid; {_METRES}"
    elif body.mass > DENSEST * volume and _is_ball(body, shapes):
        yield f"{density}, denser than osmium; {_METRES}"


def _is_ball(body: Body, shapes: list[Geometry]) -> bool:
    """True if no part of the body need lie outside its only shape, a sphere: its inertia is at most a hollow ball's."""
    if len(shapes) != 1 or shapes[0].kind != "sphere":
        return False
    largest = float(np.linalg.eigvalsh(np.array(body.inertia))[-1])
    return largest <= (2 / 3) * body.mass * (shapes[0].radius or 0.0) ** 2 * (1 + 1e-9)


def _shape(shape: Geometry) -> Iterator[str]:
    sizes = [shape.radius or 0.0, shape.length or 0.0, *(shape.axes or ()), *(shape.size or ())]
    if max(sizes) > LARGE and shape.body != "world":
        yield f"a size of {max(sizes):.4g} m; {_METRES}"
    largest = max(map(abs, shape.orientation))
    if _TURN < largest <= _MOST:
        yield f"an angle of {largest:.4g} rad is {largest / _TURN:.1f} turns; {_RADIANS}"
