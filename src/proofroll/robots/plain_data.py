"""Robots and states as plain data, which JSON holds, and back."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.robots.model import WORLD, Mimic, Robot, RobotBody, RobotJoint
from proofroll.robots.states import States


def plain(value: Any) -> Any:
    """Dataclasses, mappings and arrays as dicts, lists and numbers."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def robot_from(data: Mapping[str, Any]) -> Robot:
    """The robot of which :func:`plain` made this; its ``sources`` stay plain."""
    return Robot(
        data["name"],
        {name: RobotBody(**_arrays(body)) for name, body in data["bodies"].items()},
        tuple(RobotJoint(**_arrays(joint)) for joint in data["joints"]),
        tuple(Mimic(**mimic) for mimic in data["mimics"]),
        np.array(data["gravity"]),
        data["sources"],
    )


def states_from(data: Mapping[str, Any]) -> States:
    """The states of which :func:`plain` made this."""
    return States(**{field: _arrays(by_joint) for field, by_joint in data.items()})


def _arrays(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: np.array(item, dtype=float) if isinstance(item, list) else item for key, item in values.items()}


def mechanism_tables(robot: Robot) -> dict[str, Any]:
    """The robot as the tables of a scene with bodies and joints: numbers in SI units, angles of fixed axes x, y, z.

    Joints that follow others are not held to them there. What is 0 or absent is left out.
    """
    names = {name: name for name in robot.bodies}
    if "world" in names:  # the scene's own name for what does not move
        names["world"] = next(
            name for name in map("world_link{}".format, ("", *range(len(names)))) if name not in names
        )
    names[WORLD] = "world"
    magnitude = float(np.linalg.norm(robot.gravity))
    direction = (robot.gravity / magnitude if magnitude else np.array([0.0, 0.0, -1.0])).tolist()
    return {
        "gravity": {"magnitude": magnitude, "direction": direction},
        "bodies": [
            {"name": names[body.name], "mass": body.mass, "com": body.com.tolist(), "inertia": body.inertia.tolist()}
            for body in robot.bodies.values()
        ],
        "joints": [_joint_table(joint, names) for joint in robot.joints],
    }


def _joint_table(joint: RobotJoint, names: Mapping[str, str]) -> dict[str, Any]:
    table: dict[str, Any] = {"name": joint.name, "kind": joint.kind}
    table |= {"parent": names[joint.parent], "child": names[joint.child]}
    table["orientation"] = Rotation.from_matrix(joint.rotation).as_euler("xyz").tolist()
    table |= {key: getattr(joint, key).tolist() for key in ("position", "child_position")}
    if joint.kind in {"revolute", "prismatic"}:
        table["axis"] = joint.axis.tolist()
    laws = ("damping", "friction", "armature", "stiffness", "rest")
    table |= {key: value for key in laws if (value := getattr(joint, key))}
    if joint.lower is not None and joint.upper is not None and joint.lower < joint.upper:
        table["limits"] = [joint.lower, joint.upper]
    return table
