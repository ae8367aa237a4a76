"""Tables of a scene from a robot file: its tree of links, loops, couplings and actuators, in any start.

Links connected by fixed joints are one body, in the frame of the child of its moving joint. Constraints that close the
tree are loops and couplings; joints in them start near the file's pose, at rest. Contacts and looks are left out.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import tostring

import numpy as np

from proofroll.core.errors import InputError
from proofroll.core.number_format import counted
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, FACTS, LAWS, ONE_COORDINATE, JointKind
from proofroll.elements.mechanism.scene.rotations import from_quaternion, to_quaternion, to_rpy
from proofroll.robots.files.meaning import opened, robot_of_text
from proofroll.robots.files.robot_file import Keyframe, RobotFile
from proofroll.robots.files.urdf import extra_dynamics
from proofroll.robots.model import NO_BODY, Array, Cord, Mimic, Robot, RobotActuator, RobotJoint, RobotLoop, Tie
from proofroll.robots.states import RobotStates

ENDINGS = (".urdf", ".xml", ".sdf")  # of robot files; the reader says which it cannot read
_NEAR = 0.2  # part of a random coordinate that a guess of a closed pose is away from the file's pose, which is closed
# Parameters: default, unit, meaning, bounds.
ParameterRow = tuple[float, str, str, dict[str, Any]]
SWITCH: dict[str, Any] = {"at_least": 0, "at_most": 1, "integer": True}
CONTACTS = "contacts"  # clause on what a scene without a ground leaves out
_FACTORS = {
    "damping": "damping of the joints in parts of the file's",
    "friction": "dry friction of the joints in parts of the file's",
    "armature": "armature of the joints in parts of the file's",
    "stiffness": "stiffness of the joints in parts of the file's",
}


def described(file: RobotFile, parameters: Mapping[str, ParameterRow]) -> dict[str, Any]:
    """Source and parameters of a robot's scene, as in a scene file."""
    name = file.path.name
    return {
        "source": f"{name}, {file.kind.upper()}",
        "parameters": {
            key: {"value": value, "unit": unit, "meaning": words, "source": name, **bounds}
            for key, (value, unit, words, bounds) in parameters.items()
        },
    }


def laws(robot: Robot) -> dict[str, ParameterRow]:
    """Parameters of the laws of a robot's joints, and of what it leaves out."""
    parameters: dict[str, ParameterRow] = {}
    for law, words in _FACTORS.items():
        if any(getattr(joint, law) for joint in robot.moving):
            parameters[law] = (1.0, "1", words, {"at_least": 0})
    if any(joint.lower is not None or joint.upper is not None for joint in robot.moving):
        parameters["limits"] = (0, "1", "whether the joints have their stops (1) or turn through them (0)", SWITCH)
    if any(body.compensation for body in robot.bodies.values()):
        parameters["gravcomp"] = (1, "1", "whether the compensation of gravity of bodies acts (1) or not (0)", SWITCH)
    parameters["couplings"] = (1, "1", "whether couplings of joints outside the tree are asked for", SWITCH)
    if any(body.impossible for body in robot.bodies.values()):
        words = "whether each link must be physically possible (1), or only all that a joint moves together (0)"
        parameters["possible"] = (1, "1", words, SWITCH)
    return parameters


def tables_of(file: RobotFile, robot: Robot, start: RobotStates, values: Mapping[str, float]) -> dict[str, Any]:
    """Tables of a robot's scene that begins in the first of some states, without actuators.

    Raises:
        InputError: nothing in the file moves, or a link has an impossible inertia.
    """
    path = file.path
    if not robot.moving:
        hint = "; try --set free_base=1" if file.kind == "urdf" and not values.get("free_base") else ""
        raise InputError("file", path, f"nothing in it moves{hint}")
    for link, body in robot.bodies.items() if values.get("possible") else ():
        if body.impossible:
            advice = f"it {body.impossible}; correct it, or take the bodies of each joint as one by possible=0"
            raise InputError(f"{path}: <link {link}> inertia", body.moments.tolist(), advice)
    names, near = names_of_bodies(robot), 1.0 if values.get("keyframe") else _NEAR
    with_couplings = bool(values["couplings"])
    following = _following(robot) if with_couplings else frozenset()
    gravity = robot.gravity if robot.gravity.any() else np.array([0.0, 0.0, -1.0])
    up = -gravity / np.linalg.norm(gravity)
    bodies = [(names[joint.child], robot.groups[joint.name]) for joint in robot.moving]
    carriers = {robot.welded[joint.parent][0] for joint in robot.moving}
    return {
        "gravity": {"magnitude": values["gravity"], "direction": gravity.tolist()},
        "bodies": [
            {"name": name, "mass": body.mass, "com": body.com.tolist(), "inertia": body.inertia.tolist()}
            for name, body in bodies
        ],
        "joints": [
            _joint(robot, joint, names, start, values) | (_guess(joint, start, near) if joint.name in following else {})
            for joint in robot.moving
        ],
        "loops": [_loop(robot, link, names) for link in _links(robot)] if with_couplings else [],
        "points": [
            {"name": name, "body": name, "position": body.com.tolist()}
            for joint, (name, body) in zip(robot.moving, bodies, strict=True)
            if joint.name not in carriers
        ],
        "couplings": list(_coupled(robot)) if with_couplings else [],
        "forces": list(_compensations(robot, names, values["gravity"] * up)) if values.get("gravcomp") else [],
        "unmodelled": [
            *(f"{what} (couplings=0 leaves it out)" for what in _couplings(file, robot) if with_couplings),
            *(
                f"the {law} of the {joint.kind} joint {joint.name} ({law}=0 leaves all out)"
                for joint in robot.moving
                for law in _FACTORS
                if values.get(law, 0) * getattr(joint, law) and joint.kind not in LAWS[law]
            ),
            *(
                f"the range of the {joint.kind} joint {joint.name} (limits=0 leaves all out)"
                for joint in robot.moving
                if values.get("limits") and joint.upper is not None and joint.dofs != 1
            ),
        ],
        "omitted": list(_omitted(file, robot, values)),
    }


def _compensations(robot: Robot, names: Mapping[str, str], up: Array) -> Iterator[dict[str, Any]]:
    """Tables of the forces that carry bodies; ``up``: acceleration against gravity [m/s²], shape (3,)."""
    for link, body in robot.bodies.items():
        carrier, p, R = robot.carried(link)
        if body.compensation and carrier != NO_BODY:
            row = {"name": f"gravcomp {link}", "body": names[carrier], "kind": "force"}
            force = body.compensation * body.mass * up
            yield row | {"position": (p + R @ body.com).tolist(), "value": force.tolist()}


def _omitted(file: RobotFile, robot: Robot, values: Mapping[str, float]) -> Iterator[str]:
    """Clauses on what a robot file describes and its scene leaves out, each with the parameter that brings it in."""
    ranges = sum(joint.lower is not None or joint.upper is not None for joint in robot.moving)
    if ranges and not values.get("limits"):
        yield f"{counted(ranges, 'joint ranges')} (limits=1)"
    if robot.actuators and values.get("actuators") == 0:
        yield f"{counted(len(robot.actuators), 'actuators')} (actuators=1)"
    if values.get("keyframe") == 0:
        yield f"{counted(len(file.keyframes), 'keyframes')} (keyframe=1)"
    for law in _FACTORS:
        if values.get(law) == 0 and any(getattr(joint, law) for joint in robot.moving):
            yield f"{law} of joints ({law}=1)"
    coupled = len(robot.mimics) + len(robot.loops) + len(robot.ties) + len(robot.cords)
    coupled += sum(1 for _ in _couplings(file, robot.change(mimics=(), ties=())))
    if coupled and not values["couplings"]:
        yield f"{counted(coupled, 'couplings')} (couplings=1)"
    if values.get("gravcomp") == 0:
        compensated = sum(bool(body.compensation) for body in robot.bodies.values())
        yield f"gravity compensation of {counted(compensated, 'bodies')} (gravcomp=1)"
    extra = Counter(key for joint in file.root.iter("joint") for key in extra_dynamics(joint))
    yield from (f"{key} of {counted(number, 'joints')}" for key, number in extra.items())
    yield CONTACTS


def read_robot(path: Path, base: str) -> tuple[RobotFile, Robot]:
    """File of a robot, and the robot that it describes, with the rotors of its transmissions as armatures."""
    file = opened(path, base)
    robot = robot_of_text(file.path, file.kind, base, tostring(file.root, "utf-8"))
    rotors = file.rotors
    joints = (replace(joint, armature=joint.armature + rotors.get(joint.name, 0.0)) for joint in robot.joints)
    return file, robot.change(joints=tuple(joints)) if rotors else robot


def names_of_bodies(robot: Robot) -> dict[str, str]:
    """Link -> name of its body in the scene; a link called ``world`` is renamed, as a scene has its own ``world``."""
    names = {joint.child: joint.child for joint in robot.moving}
    if "world" in names:
        free = ("world_link" + "_" * number for number in range(len(robot.bodies) + 1))
        names["world"] = next(name for name in free if name not in robot.bodies)
    return names


def _joint(
    robot: Robot, joint: RobotJoint, names: Mapping[str, str], start: RobotStates, values: Mapping[str, float]
) -> dict[str, Any]:
    """Scene table of a joint; its ends are the scene's bodies, which may hold several links."""
    home, p, R = robot.welded[joint.parent]
    carrier = next((moving.child for moving in robot.moving if moving.name == home), NO_BODY)
    table: dict[str, Any] = {"name": joint.name, "kind": joint.kind}
    table |= {"parent": "world" if home == NO_BODY else names[carrier], "child": names[joint.child]}
    table["child_position"] = joint.child_position.tolist()
    laws = {
        law: values[law] * getattr(joint, law) for law in _FACTORS if joint.kind in LAWS[law] and getattr(joint, law)
    }
    v = (1.0 if values.get("keyframe") else values.get("speed", 1.0)) * start.velocity[joint.name][0]
    if joint.kind == JointKind.FREE:  # its coordinates are relative to the world, whatever its parent is
        turned = start.rotation[joint.name][0]
        q = [*start.position[joint.name][0], *to_quaternion(turned).tolist()]
        return table | laws | {"q0": q, "v0": [*(turned.T @ v[:3]), *(turned.T @ v[3:])]}
    table["position"] = (p + R @ joint.position).tolist()
    table["orientation"] = list(to_rpy(R @ joint.rotation))
    if joint.kind == JointKind.SPHERICAL:
        table |= {"q0": to_quaternion(start.rotation[joint.name][0]).tolist()}
    else:
        table |= {"axis": joint.axis.tolist(), "q0": [float(start.angle[joint.name][0])], "rest": joint.rest}
    table |= laws | {"v0": v.tolist()}
    if values.get("limits") and joint.lower is not None and joint.upper is not None and joint.lower < joint.upper:
        table["limits"] = [joint.lower, joint.upper]
    return table


def _coupled(robot: Robot) -> Iterator[dict[str, Any]]:
    """Tables of couplings for joints that follow another one."""
    for mimic in robot.mimics:
        if _follows(robot, mimic):
            ends = {"joint_a": mimic.other, "joint_b": mimic.joint}
            yield {"name": mimic.joint, **ends, "ratio": mimic.multiplier, "offset": mimic.offset}
    for tie in filter(partial(_tied, robot), robot.ties):
        yield {"name": tie.name, "joints": tie.joints, "coefficients": tie.coefficients, "offset": tie.value}


def _follows(robot: Robot, mimic: Mimic) -> bool:
    """True if a coupling of a scene can represent a mimic."""
    dofs = {joint.name: joint.dofs for joint in robot.moving}
    return bool(mimic.multiplier) and dofs.get(mimic.joint) == dofs.get(mimic.other) == 1


def _tied(robot: Robot, tie: Tie) -> bool:
    """True if a coupling of a scene can represent a tie."""
    dofs = {joint.name: joint.dofs for joint in robot.moving}
    return len(tie.joints) > 1 and all(tie.coefficients) and all(dofs.get(name) == 1 for name in tie.joints)


def _following(robot: Robot) -> frozenset[str]:
    """Moving joints whose start follows from loops and ties: those between the bodies of a loop, and those of a tie."""
    between = (_between(robot, loop) for loop in robot.loops)
    tied = (set(tie.joints) for tie in robot.ties if _tied(robot, tie))
    free = {joint.name for joint in robot.moving if joint.kind == JointKind.FREE}
    return frozenset(set().union(*between, *tied) - free)


def _between(robot: Robot, link: RobotLoop | Cord) -> set[str]:
    """Moving joints between the two bodies of a loop or a cord."""
    by_child = {joint.child: joint for joint in robot.joints}

    def carriers(body: str) -> set[str]:
        names = set()
        while body != NO_BODY:
            joint = by_child[body]
            body = joint.parent
            names |= {joint.name} if joint.dofs else set()
        return names

    return carriers(link.body_a) ^ carriers(link.body_b)


def _links(robot: Robot) -> list[RobotLoop | Cord]:
    """Loops, and cords between bodies that move relative to each other, with names that no joint and no loop has."""
    taken = {joint.name for joint in robot.joints} | {loop.name for loop in robot.loops}
    cords = [cord for cord in robot.cords if _between(robot, cord)]
    named = (replace(cord, name=f"{cord.name}_cord") if cord.name in taken else cord for cord in cords)
    return [*robot.loops, *named]


def held_start(robot: Robot, start: RobotStates) -> RobotStates:
    """First of some states, with the joints that move an end of a cord at rest in the pose of the file."""
    joints = {joint.name: joint for joint in robot.moving}
    names = set().union(*(_between(robot, cord) for cord in robot.cords))
    held_joints = {name: joints[name] for name in names}
    poses = {name: robot.sources[joint.child] for name, joint in held_joints.items() if joint.kind == JointKind.FREE}
    turning = {name for name, joint in held_joints.items() if joint.kind == JointKind.SPHERICAL}
    return replace(
        start,
        angle=start.angle | {name: np.zeros(1) for name in names & start.angle.keys()},
        rotation=start.rotation
        | {name: np.eye(3)[None] for name in turning}
        | {name: np.array(pose["rotation"])[None] for name, pose in poses.items()},
        position=start.position | {name: np.array(pose["position"])[None] for name, pose in poses.items()},
        velocity=start.velocity | {name: np.zeros((1, joint.dofs)) for name, joint in held_joints.items()},
    )


def keyframe_states(robot: Robot, keyframe: Keyframe) -> RobotStates:
    """The state of a keyframe; what it leaves out is the pose of the file, at rest.

    Raises:
        InputError: more or fewer numbers than coordinates of the robot.
    """
    widths = {
        joint.name: {JointKind.FREE: 7, JointKind.SPHERICAL: 4}.get(JointKind(joint.kind), 1) for joint in robot.moving
    }
    for key, vector, size in (("qpos", keyframe.qpos, sum(widths.values())), ("qvel", keyframe.qvel, robot.dofs)):
        if len(vector) not in {0, size}:
            advice = f"this keyframe has {counted(len(vector), 'numbers')}, and the joints of the file {size}"
            raise InputError(f"<key {key}>", list(vector), advice)
    angle, rotation, position, velocity = {}, {}, {}, {}
    place, rates = 0, np.array(keyframe.qvel or np.zeros(robot.dofs))
    for joint in robot.moving:
        q = np.array(keyframe.qpos[place : place + FACTS[JointKind(joint.kind)].nq])
        v = rates[robot.columns[joint.name]]
        place += q.size
        home = robot.sources[joint.child]
        if joint.kind in ONE_COORDINATE:
            angle[joint.name] = q - joint.ref if q.size else np.zeros(1)
        elif q.size:
            rotation[joint.name] = from_quaternion(q[-4:])[None]
        else:
            rotation[joint.name] = np.array(home["rotation"] if joint.kind == JointKind.FREE else np.eye(3))[None]
        if joint.kind == JointKind.FREE:
            position[joint.name] = np.array(q[:3] if q.size else home["position"])[None]
            v = np.concatenate([v[:3], rotation[joint.name][0] @ v[3:]])
        velocity[joint.name] = v[None]
    rest = {name: np.zeros_like(rows) for name, rows in velocity.items()}
    return RobotStates(angle=angle, rotation=rotation, position=position, velocity=velocity, acceleration=rest)


def _guess(joint: RobotJoint, start: RobotStates, part: float) -> dict[str, Any]:
    """Keys of a joint whose start follows from loops: a guess in its range, at a ``part`` of a coordinate."""
    if joint.kind == JointKind.SPHERICAL:
        return {"dependent": True} if part == 1 else {"dependent": True, "q0": [1.0, 0.0, 0.0, 0.0]}
    lower, upper = (-np.inf, np.inf) if joint.lower is None or joint.upper is None else (joint.lower, joint.upper)
    guess = part * float(start.angle[joint.name][0])
    return {"dependent": True, "q0": [min(max(guess, lower), upper) if lower < upper else guess]}


def _loop(robot: Robot, loop: RobotLoop | Cord, names: Mapping[str, str]) -> dict[str, Any]:
    """Scene table of a loop or a cord; its ends are the scene's bodies, which may hold several links."""
    table: dict[str, Any] = {"name": loop.name}
    table |= {"kind": loop.kind} if isinstance(loop, RobotLoop) else {"kind": DISTANCE, "at_most": loop.at_most}
    turns = {}
    for side, link, position in (("a", loop.body_a, loop.position_a), ("b", loop.body_b, loop.position_b)):
        carrier, p, R = robot.carried(link)
        table |= {f"body_{side}": "world" if carrier == NO_BODY else names[carrier]}
        table |= {f"position_{side}": (p + R @ position).tolist()}
        turns[side] = R
    if isinstance(loop, RobotLoop) and loop.kind == JointKind.FIXED:
        table["orientation"] = list(to_rpy(turns["a"] @ loop.rotation @ turns["b"].T))
    return table


def _couplings(file: RobotFile, robot: Robot) -> Iterator[str]:
    """Clauses on what a scene leaves out: mimics, equality constraints, tendons, a viscous medium."""
    for mimic in (mimic for mimic in robot.mimics if not _follows(robot, mimic)):
        yield f"joint {mimic.joint} following {mimic.other} (mimic)"
    if file.kind != "mjcf":
        return
    yield from robot.further
    for tie in (tie for tie in robot.ties if not _tied(robot, tie)):
        yield f"the equality constraint tendon {tie.name}"
    for option in file.root.iter("option"):
        for key in ("density", "viscosity"):
            if option.get(key) not in {None, "0"}:
                yield f"a medium of {key} {option.get(key)}"


def scene_actuators(robot: Robot, controls: Sequence[float] = ()) -> tuple[list[dict[str, Any]], list[str]]:
    """Tables of the actuators that a scene can represent, and a clause for each other one.

    Args:
        robot: the robot of the file.
        controls: of its actuators, in their order; empty: all are zero.

    Raises:
        InputError: there are more or fewer controls than actuators.
    """
    if controls and len(controls) != len(robot.actuators):
        advice = (
            f"this keyframe has {counted(len(controls), 'controls')}, and the file {len(robot.actuators)} actuators"
        )
        raise InputError("<key ctrl>", list(controls), advice)
    clauses = [f"the actuator {item.name} with its {item.unlike}" for item in robot.actuators if item.unlike]
    at_joints: dict[str, dict[RobotActuator, float]] = {joint.name: {} for joint in robot.moving if joint.dofs == 1}
    for actuator, control in zip(robot.actuators, controls or [0.0] * len(robot.actuators), strict=True):
        others = at_joints.get(actuator.joint, {})
        if not actuator.unlike and others and any(item.limit is not None for item in (actuator, *others)):
            clauses.append(f"the actuator {actuator.name} beside another of its joint, with a limit of one alone")
        elif not actuator.unlike:
            others[actuator] = control
    return [_table(joint, at_joints[joint.name]) for joint in robot.moving if at_joints.get(joint.name)], clauses


def _table(joint: RobotJoint, controls: dict[RobotActuator, float]) -> dict[str, Any]:
    """Table of the sum of a joint's actuators, each with its control."""
    first, *others = controls
    gear = 1.0 if others else first.gear
    kp, kd, push = 0.0, 0.0, 0.0
    for actuator, control in controls.items():
        turns = actuator.gear / gear
        lowest, highest = actuator.ends or (control, control)
        kp, kd = kp + turns**2 * actuator.kp, kd + turns**2 * actuator.kd
        effort = actuator.gain * min(max(control, lowest), highest) + actuator.bias
        push += turns * (effort - actuator.kp * actuator.gear * joint.ref)
    kind = "position" if kp else "velocity" if kd else "torque"
    gains = {key: gain for key, gain in (("kp", kp), ("kd", kd)) if gain}
    limits = [limit for limit in (first.limit, joint.effort) if limit is not None]
    bound = {"limit": min(limits)} if limits else {}
    name = {"name": first.name, "joint": joint.name}
    return {**name, "kind": kind, "gear": gear, **gains, "target": push / (kp or kd or 1.0), **bound}
