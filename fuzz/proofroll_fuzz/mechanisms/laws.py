"""Laws that a random mechanism may have besides its joints: each adds itself to a sketch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from proofroll.adapter import WORLD, JointKind
from proofroll.adapter import MechanismCapability as Capability
from proofroll.elements.mechanism.scene.rotations import from_rpy, to_rpy
from proofroll_fuzz.drawing import three_digits
from proofroll_fuzz.mechanisms.poses import floats
from proofroll_fuzz.mechanisms.sketch import SCREW, Sketch


def _joint_springs(sketch: Sketch) -> None:
    joint, choices = sketch.simple_joint(), sketch.choices
    effort, unit = sketch.effort(joint), sketch.unit(joint)
    if choices.happens(0.6):
        joint["stiffness"] = choices.decade(-1, 1.5, effort / unit)
        joint["rest"] = choices.number(-1, 1, unit)
    if choices.happens(0.6):
        joint["damping"] = choices.decade(-2, 0.5, effort / unit * sketch.time)
    if choices.happens(0.4) or not {"stiffness", "damping"} & joint.keys():
        joint["torque"] = choices.number(-1, 1, effort)


def _friction(sketch: Sketch) -> None:
    joint = sketch.simple_joint()
    joint["friction"] = sketch.choices.decade(-2, 0.3, sketch.effort(joint))


def _armature(sketch: Sketch) -> None:
    joint = sketch.simple_joint()
    inertia = sketch.mass * (sketch.length / sketch.unit(joint)) ** 2
    joint["armature"] = sketch.choices.decade(-3, 1, inertia)


def _stops(sketch: Sketch) -> dict[str, Any]:
    joint, choices = sketch.simple_joint(), sketch.choices
    unit, start = sketch.unit(joint), joint.get("q0", 0.0)
    joint["limits"] = [start - choices.number(0.1, 0.6, unit), start + choices.number(0.1, 0.6, unit)]
    return joint


def _rebounds(sketch: Sketch) -> None:
    _stops(sketch)["restitution"] = sketch.choices.pick((0.3, 0.5, 1.0))


def _motion(sketch: Sketch) -> None:
    joint, choices = sketch.simple_joint(), sketch.choices
    size, rate = choices.number(0.1, 0.4, sketch.unit(joint)), choices.number(1, 3, 1 / sketch.time)
    start = joint.get("q0", 0.0)
    for key in set(joint) & {"q0", "v0", "dependent", "friction", "limits", "restitution", "torque", "armature",
                             "stiffness", "rest", "damping"}:  # fmt: skip
        del joint[key]
    joint["motion"] = f"= {start!r} + {size!r}*sin({rate!r}*t)"


def _actuator(sketch: Sketch, kinds: Sequence[str] = ("position", "velocity", "torque")) -> dict[str, Any]:
    joint, choices = sketch.simple_joint(), sketch.choices
    effort, unit, kind = sketch.effort(joint), sketch.unit(joint), choices.pick(kinds)
    row = sketch.add("actuators", joint=joint["name"], kind=kind)
    size = {"position": unit, "velocity": unit / sketch.time, "torque": effort}[kind]
    row["target"] = choices.number(-1, 1, size)
    if kind == "position":
        row["kp"] = choices.decade(-1, 1, effort / unit)
    if kind != "torque":
        row["kd"] = choices.decade(-1.5, 0, effort / unit * sketch.time)
    if choices.happens(0.4):
        row["gear"] = choices.pick((5.0, -2.0, 0.5))
    return row


def _saturation(sketch: Sketch) -> None:
    row = _actuator(sketch)
    joint = next(item for item in sketch.tables["joints"] if item["name"] == row["joint"])
    row["limit"] = sketch.choices.decade(-1, 0.5, sketch.effort(joint))


def _signals(sketch: Sketch) -> None:
    rate = sketch.choices.number(1, 4, 1 / sketch.time)
    if sketch.choices.happens(0.5):
        row = _actuator(sketch)
        row["target"] = f"= {row['target']!r}*cos({rate!r}*t)"
    else:
        joint = sketch.simple_joint()
        joint["torque"] = f"= {sketch.choices.number(-1, 1, sketch.effort(joint))!r}*sin({rate!r}*t)"


def _springs(sketch: Sketch) -> dict[str, Any]:
    choices, unit = sketch.choices, sketch.mass * sketch.gravity / sketch.length
    body_b = choices.pick(sketch.bodies)
    body_a = choices.pick([WORLD, *(name for name in sketch.bodies if name != body_b)])
    position_b = choices.vector(0.5 * sketch.length)
    direction = sketch.turned()[:, 2]
    end = sketch.place(body_b) + sketch.rotation(body_b) @ position_b + choices.number(1, 2, sketch.length) * direction
    ends = {"body_a": body_a, "body_b": body_b, "position_a": sketch.in_body(body_a, end), "position_b": position_b}
    row = sketch.add("springs", **ends, stiffness=choices.decade(-1, 1, unit))
    row["length"] = choices.number(0, 2, sketch.length)
    if choices.happens(0.5):
        row["damping"] = choices.decade(-2, 0, unit * sketch.time)
    return row


def _spring_laws(sketch: Sketch) -> None:
    row = _springs(sketch)
    cubic = sketch.choices.number(0.1, 2, sketch.mass * sketch.gravity / sketch.length**3)
    row["force"] = f"= {cubic!r}*(L - {three_digits(sketch.length)!r})^3"


def _bushing(sketch: Sketch) -> None:
    choices, unit = sketch.choices, sketch.mass * sketch.gravity / sketch.length
    body = choices.pick(sketch.bodies)
    sizes = [unit] * 3 + [unit * sketch.length**2] * 3
    unloaded = sketch.rotation(body) @ from_rpy(choices.vector(0.5))
    sketch.add(
        "bushings",
        body_a=WORLD,
        body_b=body,
        position_a=floats(sketch.place(body)),
        orientation_a=floats(to_rpy(unloaded)),
        stiffness=[choices.decade(-1, 1, size) for size in sizes],
        damping=[choices.decade(-2, -1, size * sketch.time) for size in sizes],
    )


def _force(sketch: Sketch) -> None:
    choices, size = sketch.choices, sketch.mass * sketch.gravity
    kind = choices.pick(("force", "moment"))
    row = sketch.add("forces", body=choices.pick(sketch.bodies), kind=kind, frame=choices.pick((WORLD, "body")))
    row["value"] = choices.vector(size if kind == "force" else size * sketch.length)
    if kind == "force":
        row["position"] = choices.vector(0.5 * sketch.length)


def _coupling(sketch: Sketch) -> None:
    if sketch.choices.happens(0.3):  # a screw couples its turn and its travel
        sketch.add_joint(SCREW, sketch.choices.pick(sketch.bodies), sketch.add_body()["name"])
        return
    joints = []
    for _ in range(2):
        joint = sketch.simple_joint((JointKind.REVOLUTE,))
        while joint in joints:
            joint = sketch.add_joint(JointKind.REVOLUTE, joint["child"], sketch.add_body()["name"])
        joints.append(joint)
    ratio, rate = sketch.choices.pick((2.0, -0.5, 4.0)), sketch.choices.number(-1, 1, 1 / sketch.time)
    for joint, speed in zip(joints, (rate, ratio * rate), strict=True):
        joint |= {"q0": 0.0, "v0": speed}
        if "limits" in joint:
            joint["limits"] = [-0.5, 0.5]
    sketch.add("couplings", joint_a=joints[0]["name"], joint_b=joints[1]["name"], ratio=ratio)


def controller(sketch: Sketch, every: float) -> dict[str, Any]:
    """Controller that reads the target of a servo at each sample; ``every``: sampling interval [s]."""
    row = _actuator(sketch, ("position",))
    row["target"] = f"= {row['target']!r}*cos({sketch.choices.number(1, 4, 1 / sketch.time)!r}*t)"
    return {"rate": 1 / every, "actuators": [row["name"]]}


# Law -> what adds it, in the order in which they are added: a coupling and a motion choose their joints first.
LAWS: Mapping[str, Callable[[Sketch], object]] = {
    Capability.COUPLINGS: _coupling,
    Capability.MOTIONS: _motion,
    Capability.JOINT_SPRINGS: _joint_springs,
    Capability.JOINT_FRICTION: _friction,
    Capability.ARMATURE: _armature,
    Capability.STOPS: _stops,
    Capability.REBOUNDS: _rebounds,
    Capability.ACTUATORS: _actuator,
    Capability.SATURATION: _saturation,
    Capability.SIGNALS: _signals,
    Capability.SPRINGS: _springs,
    Capability.SPRING_LAWS: _spring_laws,
    Capability.BUSHINGS: _bushing,
    Capability.APPLIED_FORCES: _force,
}
WEIGHTS = dict.fromkeys(LAWS, 0.06)


def add_laws(sketch: Sketch, features: Collection[str]) -> None:
    """Adds the laws among some features, in the order of :data:`LAWS`."""
    for name, law in LAWS.items():
        if name in features:
            law(sketch)
