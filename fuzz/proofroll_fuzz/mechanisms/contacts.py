"""Random bodies, alone or with a link, that rest, slide, roll or fall on a floor, in curved walls, on one another."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.adapter import WORLD, Array, JointKind, to_quaternion
from proofroll.adapter import MechanismCapability as Capability
from proofroll.elements.mechanism.scene.rotations import about
from proofroll_fuzz.drawing import Choices
from proofroll_fuzz.mechanisms.closing import extent
from proofroll_fuzz.mechanisms.poses import floats
from proofroll_fuzz.mechanisms.sketch import Sketch

_ON_FLOORS = ("sphere", "ellipsoid", "box", "capsule", "cylinder")
_LONG = frozenset({"capsule", "cylinder"})  # touch at two ends, whose moments the reader refuses
_WALLS = {"bowl": -1.0, "bore": -1.0, "shaft": 1.0}  # side of a wall's circle on which a ball touches it
_TOPS = {"sphere": ("sphere",), "box": ("sphere", "capsule"), "capsule": ("sphere", "capsule")}
_LINKS = (Capability.REVOLUTE, Capability.PRISMATIC, Capability.SPHERICAL)
SECOND, SLOPE, FALL, UNEQUAL = "a body on top", "a slope", "a fall", "unequal moments"
_LAWS = (
    Capability.CONTACT_FRICTION,
    Capability.STATIC_FRICTION,
    Capability.UNBOUNDED_FRICTION,
    Capability.CONTACT_REBOUNDS,
    Capability.SLIP_REBOUNDS,
    Capability.TURNING_FRICTION,
    Capability.APPLIED_FORCES,
    Capability.MOTIONS,
    Capability.SIGNALS,
    *_LINKS,
)
CONTACT_FEATURES: Mapping[str, float] = {
    **dict.fromkeys((*_ON_FLOORS, *_WALLS), 0.0),
    **dict.fromkeys(_LAWS, 0.12),
    **{SECOND: 0.05, SLOPE: 0.3, FALL: 0.2, UNEQUAL: 0.3},
}


def contact(choices: Choices, features: Sequence[str]) -> dict[str, Any]:
    """A body on a floor, or a ball on a curved wall, with what is among the features: a link, a body on top, laws."""
    sketch = Sketch(choices)
    sketch.speed = min(sketch.speed, 3.0)
    turning = Capability.TURNING_FRICTION in features
    able = [name for name in (*_ON_FLOORS, *_WALLS) if not (turning and name in _LONG)]
    shape = next((name for name in able if name in features), "") or choices.pick(able)
    floor, origin = sketch.turned(), np.array(choices.vector(sketch.length))
    slope = choices.number(-0.5, 0.5) if SLOPE in features else 0.0
    sketch.fall_along(floor @ np.array([math.sin(slope), 0.0, -math.cos(slope)]))
    size, pair = choices.number(0.1, 0.3, sketch.length), _pair(choices, features, sketch.length)
    if shape in _WALLS:
        normal, surface = _wall(sketch, shape, floor, origin)
        _place(sketch, "sphere", features, size, normal, surface, pair)
        _load(sketch, features, floor)
        return sketch.content()
    _ground(sketch, features, floor, origin)
    carries = SECOND in features and shape in _TOPS
    stuck = carries and Capability.UNBOUNDED_FRICTION in features  # to the ball on top, which rests
    top = _place(sketch, shape, features, size, floor, origin, pair, at_rest=stuck)
    _load(sketch, features, floor)
    if carries:
        on_top = choices.pick(_TOPS[shape]) if not turning else "sphere"
        laws = [feature for feature in features if feature != FALL]
        _place(sketch, on_top, laws, choices.number(0.1, 0.3, sketch.length), floor, top, pair, at_rest=True)
    return sketch.content()


def _ground(sketch: Sketch, features: Collection[str], floor: Array, origin: Array) -> None:
    """Adds a plane of the world, or of a table whose prescribed motion starts from rest."""
    body, place, choices = WORLD, origin, sketch.choices
    if Capability.MOTIONS in features:
        body, place = sketch.add_body(name="table")["name"], np.zeros(3)
        size, rate = choices.number(0.02, 0.1, sketch.length), choices.number(1, 4, 1 / sketch.time)
        direction = floats(floor @ np.array(choices.pick(([1, 0, 0], [0, 0, 1], [0.6, 0, 0.8]))))
        motion = f"= 0.0 + {size!r}*(1 - cos({rate!r}*t))"
        slide = {"kind": str(JointKind.PRISMATIC), "parent": WORLD, "child": body, "position": floats(origin)}
        sketch.hang(sketch.add("joints", **slide, axis=direction, motion=motion))
    normal = floats(floor[:, 2])
    sketch.add("geometries", name="ground", body=body, kind="plane", position=floats(place), normal=normal)


def _load(sketch: Sketch, features: Collection[str], floor: Array) -> None:
    """Adds to the last body a push along the floor, a moment that changes in time, and links."""
    choices, body, weight = sketch.choices, sketch.bodies[-1], sketch.mass * sketch.gravity
    if Capability.APPLIED_FORCES in features:
        push = floats(floor[:, 0] * weight * choices.number(-0.5, 0.5))
        sketch.add("forces", body=body, kind="force", frame=WORLD, value=push)
    if Capability.SIGNALS in features:
        size = choices.number(-0.1, 0.1, weight * sketch.length)
        value = [f"= {size!r}*sin({choices.number(1, 4, 1 / sketch.time)!r}*t)", 0, 0]
        sketch.add("forces", body=body, kind="moment", frame="body", value=value)
    for kind in (kind for kind in _LINKS if kind in features):
        sketch.add_joint(JointKind[kind.name], body, sketch.add_body()["name"])


def _pair(choices: Choices, features: Collection[str], length: float) -> dict[str, Any]:
    """Laws of every pair of geometries."""
    friction: Any = choices.number(0.2, 0.9) if Capability.CONTACT_FRICTION in features else 0.0
    if Capability.STATIC_FRICTION in features:
        friction = {"static": choices.number(0.5, 0.9), "kinetic": choices.number(0.2, 0.5)}
    if Capability.UNBOUNDED_FRICTION in features:
        friction = math.inf
    pair: dict[str, Any] = {"friction": friction}
    if Capability.CONTACT_REBOUNDS in features:
        pair["restitution"] = choices.pick((0.3, 0.7, 1.0))
    if Capability.SLIP_REBOUNDS in features:
        pair["tangential_restitution"] = choices.pick((0.5, -0.5))
    if Capability.TURNING_FRICTION in features:
        pair |= {
            "rolling_resistance": choices.decade(-3, -2, length),
            "spinning_friction": choices.decade(-3, -2, length),
        }
    return pair


def _wall(sketch: Sketch, shape: str, floor: Array, origin: Array) -> tuple[Array, Array]:
    """Adds a curved wall of the world; returns a frame whose z is its normal at a point, and the point."""
    radius = sketch.choices.number(0.5, 1.0, sketch.length)
    row = sketch.add("geometries", name="ground", body=WORLD, kind=shape, position=floats(origin), radius=radius)
    if shape != "bowl":
        row["axis"] = floats(floor[:, 0])
    frame = floor @ about(0, sketch.choices.number(-0.6, 0.6))
    return frame, origin + _WALLS[shape] * radius * frame[:, 2]


def _outline(shape: str, size: float) -> dict[str, Any]:
    """Keys of a geometry of about this size."""
    keys: Mapping[str, dict[str, Any]] = {
        "sphere": {"radius": size},
        "ellipsoid": {"axes": [size, 0.8 * size, 0.6 * size]},
        "box": {"size": [2.4 * size, 1.6 * size, 1.2 * size]},
        "capsule": {"radius": size / 2, "length": 2 * size, "axis": [1, 0, 0]},
        "cylinder": {"radius": size, "length": 1.2 * size},
    }
    return {"kind": shape, **keys[shape]}


def _place(
    sketch: Sketch,
    shape: str,
    features: Collection[str],
    size: float,
    frame: Array,
    point: Array,
    pair: Mapping[str, Any],
    at_rest: bool = False,
) -> Array:
    """Adds a body that touches the last geometry at a point, or falls on it; returns its highest point.

    Args:
        sketch: the scene.
        shape: of the body.
        features: of the scene.
        size: of the body [m].
        frame: z is the normal at the point.
        point: of the last geometry, in the world [m].
        pair: laws of the contact.
        at_rest: True for a body without velocity.
    """
    choices, normal = sketch.choices, frame[:, 2]
    falls = FALL in features
    attitude = sketch.turned() if falls or shape == "sphere" else frame @ about(2, choices.number(-3, 3))
    keys = _outline(shape, size)
    height = extent(keys, attitude.T @ normal)
    centre = point + normal * (height + (choices.number(0.05, 0.2, sketch.length) if falls else 0.0))
    body = sketch.add_body(com=[0.0, 0.0, 0.0])
    if UNEQUAL not in features:
        body["inertia"] = [body["mass"] * size**2 * 0.4] * 3
    else:
        body["inertia"] = [body["mass"] * size**2 * choices.number(0.3, 0.5) for _ in range(3)]
    rate = sketch.speed / sketch.time
    spin = np.array(choices.vector(rate)) if shape == "sphere" else np.zeros(3)
    velocity = frame @ np.array([*choices.vector(rate * sketch.length)[:2], 0.0])
    if pair["friction"] == math.inf and not falls:
        velocity = height * np.cross(spin, normal)  # rolls, or stands if it has no spin
    if at_rest:
        spin, velocity = np.zeros(3), np.zeros(3)
    start = [*centre, *to_quaternion(attitude)]
    rates = [*(attitude.T @ velocity), *(attitude.T @ spin)]
    free = {"kind": str(JointKind.FREE), "parent": WORLD, "child": body["name"]}
    sketch.hang(sketch.add("joints", **free, q0=floats(start), v0=floats(rates)))
    previous = sketch.tables["geometries"][-1]["name"]
    geometry = sketch.add("geometries", body=body["name"], **keys)
    if shape == "sphere" and previous == "ground" and "rolling_resistance" in pair:
        pair = {**pair, "against": choices.pick(("motion", "turning"))}
    sketch.add("pairs", geometries=[geometry["name"], previous], **pair)
    top: Array = centre + normal * height
    return top
