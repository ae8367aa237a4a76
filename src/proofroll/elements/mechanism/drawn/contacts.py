"""Random bodies that rest on a floor, slide, roll, or fall on it, in curved walls, and on one another."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.drawing import Choices
from proofroll.elements.mechanism.drawn.closing import extent
from proofroll.elements.mechanism.drawn.poses import WORLD, floats
from proofroll.elements.mechanism.drawn.sketch import Sketch
from proofroll.elements.mechanism.run.capabilities import MechanismCapability as Capability
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array, about, to_quaternion

_ON_FLOORS = ("sphere", "ellipsoid", "box", "capsule", "cylinder")
_LONG = frozenset({"capsule", "cylinder"})  # touch at two ends, whose moments the reader refuses
_WALLS = {"bowl": -1.0, "bore": -1.0, "shaft": 1.0}  # side of a wall's circle on which a ball touches it
SECOND, SLOPE, FALL, UNEQUAL = "a ball on top", "a slope", "a fall", "unequal moments"
_LAWS = (
    Capability.CONTACT_FRICTION,
    Capability.STATIC_FRICTION,
    Capability.UNBOUNDED_FRICTION,
    Capability.CONTACT_REBOUNDS,
    Capability.SLIP_REBOUNDS,
    Capability.TURNING_FRICTION,
    Capability.APPLIED_FORCES,
)
CONTACT_FEATURES: Mapping[str, float] = {
    **dict.fromkeys((*_ON_FLOORS, *_WALLS), 0.0),
    **dict.fromkeys(_LAWS, 0.12),
    **{SECOND: 0.05, SLOPE: 0.3, FALL: 0.2, UNEQUAL: 0.3},
}


def contact(choices: Choices, features: Sequence[str]) -> dict[str, Any]:
    """A body on a floor, or a ball on a curved wall, perhaps with a ball on top, with the laws among the features."""
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
        return sketch.content()
    sketch.add(
        "geometries", name="ground", body=WORLD, kind="plane", position=floats(origin), normal=floats(floor[:, 2])
    )
    carries = SECOND in features and shape in {"sphere", "box"}
    stuck = carries and Capability.UNBOUNDED_FRICTION in features  # to the ball on top, which rests
    top = _place(sketch, shape, features, size, floor, origin, pair, at_rest=stuck)
    if carries:
        laws = [feature for feature in features if feature != FALL]
        _place(sketch, "sphere", laws, choices.number(0.1, 0.3, sketch.length), floor, top, pair, at_rest=True)
    if Capability.APPLIED_FORCES in features:
        push = sketch.mass * sketch.gravity * choices.number(-0.5, 0.5)
        sketch.add("forces", body=sketch.bodies[0], kind="force", frame=WORLD, value=floats(floor[:, 0] * push))
    return sketch.content()


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
    sketch.add("joints", **free, q0=floats(start), v0=floats(rates))
    previous = sketch.tables["geometries"][-1]["name"]
    geometry = sketch.add("geometries", body=body["name"], **keys)
    if shape == "sphere" and previous == "ground" and "rolling_resistance" in pair:
        pair = {**pair, "against": choices.pick(("motion", "turning"))}
    sketch.add("pairs", geometries=[geometry["name"], previous], **pair)
    top: Array = centre + normal * height
    return top
