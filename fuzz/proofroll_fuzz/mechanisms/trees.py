"""Random trees of bodies, and loops that close them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.adapter import WORLD, Array, JointKind, frame_of_axis
from proofroll.adapter import MechanismCapability as Capability
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, FACTS, LOOP_FACTS
from proofroll.elements.mechanism.scene.rotations import from_rpy, to_rpy
from proofroll_fuzz.drawing import Choices, three_digits
from proofroll_fuzz.mechanisms.laws import WEIGHTS, add_laws, controller
from proofroll_fuzz.mechanisms.poses import floats
from proofroll_fuzz.mechanisms.sketch import GIMBAL, Sketch

_KINDS = {Capability[kind.upper()]: str(kind) for kind in JointKind}
GIMBALS = "ball joints by three angles"
_USUAL = (JointKind.REVOLUTE, JointKind.REVOLUTE, JointKind.PRISMATIC)  # any engine of trees has them
_MOST = 4  # bodies, unless more kinds of joints are asked for
_LOOPS = {Capability[f"{kind.upper()}_LOOP"]: kind for kind in LOOP_FACTS if kind != JointKind.FREE}
# Kinds of joints of which a sketch knows where their child starts.
_PLACED = (JointKind.REVOLUTE, JointKind.REVOLUTE, JointKind.CYLINDRICAL, JointKind.SPHERICAL)
_ROWS = {kind: len(facts.translations) + len(facts.rotations) for kind, facts in LOOP_FACTS.items()} | {DISTANCE: 1}
_HELD = Capability.HELD

TREE_FEATURES: Mapping[str, float] = {
    **dict.fromkeys((*_KINDS, GIMBALS), 0.04),
    **WEIGHTS,
    _HELD: 0.04,
}
_IN_LOOPS = {name: weight for name, weight in WEIGHTS.items() if name != Capability.COUPLINGS}
LOOP_FEATURES: Mapping[str, float] = {**dict.fromkeys(_LOOPS, 0.0), **_IN_LOOPS}
BAR_FEATURES: Mapping[str, float] = {
    Capability.PRISMATIC: 0.3,
    Capability.REVOLUTE_LOOP: 0.3,
    Capability.SPHERICAL_LOOP: 0.3,
    Capability.CYLINDRICAL_LOOP: 0.1,
    **_IN_LOOPS,
}


def tree(choices: Choices, features: Sequence[str]) -> dict[str, Any]:
    """Tree of a few bodies with joints of the kinds and the laws among the features."""
    sketch = Sketch(choices)
    kinds = [kind for feature, kind in _KINDS.items() if feature in features]
    if GIMBALS in features:
        kinds.append(GIMBAL)
    count = choices.whole(1, _MOST)
    while len(kinds) < count or not set(kinds) - {JointKind.FIXED}:
        kinds.insert(choices.whole(0, len(kinds)), choices.pick(_USUAL))
    kinds.sort(key=lambda kind: kind != JointKind.FREE)  # a free body hangs on the world
    for number, kind in enumerate(kinds):
        bodies = sketch.bodies
        grounded = number == 0 or choices.happens(0.15)
        parent = WORLD if grounded else choices.pick([bodies[-1], bodies[-1], choices.pick(bodies)])
        sketch.add_joint(kind, parent, sketch.add_body()["name"])
    add_laws(sketch, features)
    content = sketch.content()
    if _HELD in features:
        content["control"] = controller(sketch, content["every"])
        content |= sketch.tables
    return content


def loop(choices: Choices, features: Sequence[str]) -> dict[str, Any]:
    """Chain whose last body a loop of a kind among the features ties to the world or to another body."""
    sketch = Sketch(choices)
    kind = next((kind for feature, kind in _LOOPS.items() if feature in features), None) or choices.pick(
        [*_LOOPS.values()]
    )
    parent, needed = WORLD, _ROWS[kind] + (Capability.MOTIONS in features)
    freedom = {WORLD: 0}  # up to each body
    while freedom[parent] <= needed:
        joint = choices.pick([*_PLACED, JointKind.PRISMATIC] if sketch.bodies else _PLACED)
        body = sketch.add_body()["name"]
        sketch.add_joint(joint, parent, body)
        freedom[body] = freedom[parent] + FACTS[joint].nv
        parent = body
    for row in sketch.tables["joints"]:
        del row["v0"]
    able = [body for body, below in freedom.items() if freedom[parent] - below > needed]
    _close(sketch, kind, choices.pick(able), parent)
    add_laws(sketch, features)
    driven = next((row for row in sketch.tables["joints"] if "motion" in row), None)
    _follow(sketch, driven or sketch.tables["joints"][0], freedom[parent] > _ROWS[kind] + 1)
    return sketch.content()


def _follow(sketch: Sketch, leading: dict[str, Any], able: bool) -> None:
    """Lets all joints that carry a loop follow from the leading one, which may move at the start if it is able to."""
    simple = leading["kind"] in {JointKind.REVOLUTE, JointKind.PRISMATIC}
    if "motion" not in leading:
        if not (simple and able and sketch.choices.happens(0.6)):
            return
        leading["v0"] = sketch.choices.number(-2, 2, sketch.unit(leading) / sketch.time)
    for row in sketch.tables["joints"]:
        if row is not leading and "motion" not in row:
            row["dependent"] = True


def _close(sketch: Sketch, kind: str, body_a: str, body_b: str) -> None:
    """Adds a loop of a kind that is closed at the start."""
    point = sketch.place(body_b) + np.array(sketch.choices.vector(sketch.length))
    axis = sketch.turned()[:, 2]
    row = sketch.add("loops", kind=kind, body_a=body_a, body_b=body_b, position_a=sketch.in_body(body_a, point))
    if kind == DISTANCE:
        apart = sketch.choices.number(0.5, 1.5, sketch.length) * axis
        row |= {"position_b": sketch.in_body(body_b, point + apart), "length": float(np.linalg.norm(apart))}
        return
    row["position_b"] = sketch.in_body(body_b, point)
    if kind in {JointKind.REVOLUTE, JointKind.CYLINDRICAL, JointKind.PLANAR, JointKind.PRISMATIC, JointKind.UNIVERSAL}:
        row["axis_a"] = sketch.along(body_a, axis)
    if kind in {JointKind.REVOLUTE, JointKind.CYLINDRICAL, JointKind.PLANAR}:
        row["axis_b"] = sketch.along(body_b, axis)
    if kind == JointKind.UNIVERSAL:
        row["axis_b"] = sketch.along(body_b, frame_of_axis(axis)[:, 0])
    if kind in {JointKind.FIXED, JointKind.PRISMATIC}:
        row["orientation"] = floats(to_rpy(sketch.rotation(body_a).T @ sketch.rotation(body_b)))


def bar(choices: Choices, features: Sequence[str]) -> dict[str, Any]:
    """Four-bar, or slider-crank, in a plane of any orientation: what follows from the loop is found by the reader."""
    sketch = Sketch(choices)
    length, tilt = sketch.length, choices.vector(1.5)
    crank, rod, rocker = (choices.number(low, high, length) for low, high in ((0.2, 0.4), (0.8, 1.0), (0.7, 0.9)))
    angle = choices.number(-1, 1)
    slides = Capability.PRISMATIC in features
    end = np.array([crank * math.cos(angle), crank * math.sin(angle)])
    knee = np.array([end[0] + math.sqrt(rod**2 - end[1] ** 2), 0.0]) if slides else _knee(end, rod, length, rocker)
    turn = math.atan2(*(knee - end)[::-1])
    for name, size in (("crank", crank), ("rod", rod), ("output", rocker)):
        mass = sketch.add_body(name=name, com=[size / 2, 0, 0])["mass"]
        sketch.tables["bodies"][-1]["inertia"] = [three_digits(part * mass * size**2) for part in (0.05, 0.08, 0.09)]
    hinge: dict[str, Any] = {"child_position": None, "axis": [0, 0, 1], "v0": None, "position": [0, 0, 0]}
    revolute = JointKind.REVOLUTE
    rate = choices.number(1, 5, 1 / sketch.time)
    leading = sketch.add_joint(revolute, WORLD, "crank", **hinge | {"orientation": tilt, "q0": angle, "v0": rate})
    hinge |= {"dependent": True}
    rod_place = {"position": [crank, 0, 0], "orientation": [0, 0, 0], "q0": turn - angle}
    sketch.add_joint(revolute, "crank", "rod", **hinge | rod_place)
    if slides:
        guide = hinge | {"orientation": tilt, "axis": [1, 0, 0], "q0": float(knee[0])}
        sketch.add_joint(JointKind.PRISMATIC, WORLD, "output", **guide)
    else:
        pivot: dict[str, Any] = {"orientation": tilt, "position": floats(from_rpy(tilt) @ [length, 0, 0])}
        pivot["q0"] = math.atan2(knee[1], knee[0] - length)
        sketch.add_joint(revolute, WORLD, "output", **hinge | pivot)
    kinds = [kind for feature, kind in _LOOPS.items() if feature in features and feature in BAR_FEATURES]
    ends = {"position_a": [rod, 0, 0], "position_b": [0 if slides else rocker, 0, 0]}
    kind = kinds[0] if kinds else choices.pick((revolute, JointKind.SPHERICAL))
    sketch.add("loops", kind=kind, body_a="rod", body_b="output", **ends)
    if Capability.MOTIONS in features:
        del leading["q0"], leading["v0"]
        leading["motion"] = f"= {angle!r} + {rate!r}*t"
    add_laws(sketch, [feature for feature in features if feature != Capability.MOTIONS])
    return sketch.content()


def _knee(end: Array, rod: float, base: float, rocker: float) -> Array:
    """Upper meeting point of a rod at ``end`` and a rocker at (base, 0)."""
    line = np.array([base, 0.0]) - end
    distance = float(np.linalg.norm(line))
    cosine = (rod**2 + distance**2 - rocker**2) / (2 * rod * distance)
    angle = math.atan2(line[1], line[0]) + math.acos(max(-1.0, min(1.0, cosine)))
    return end + rod * np.array([math.cos(angle), math.sin(angle)])
