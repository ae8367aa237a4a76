"""Actuators of a robot file as tables of a scene, with constant controls."""

from collections.abc import Sequence
from typing import Any

from proofroll.core.errors import InputError
from proofroll.core.number_format import counted
from proofroll.robots.model import Robot, RobotActuator, RobotJoint


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
