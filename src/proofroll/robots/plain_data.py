"""Robots and states back from the plain data that JSON holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.robots.model import Mimic, Robot, RobotBody, RobotJoint
from proofroll.robots.states import RobotStates


def robot_from(data: Mapping[str, Any]) -> Robot:
    """The robot of which :func:`proofroll.files.json_data.plain` made this; its ``sources`` stay plain."""
    return Robot(
        data["name"],
        {name: RobotBody(**_arrays(body)) for name, body in data["bodies"].items()},
        tuple(RobotJoint(**_arrays(joint)) for joint in data["joints"]),
        tuple(Mimic(**mimic) for mimic in data["mimics"]),
        np.array(data["gravity"]),
        data["sources"],
    )


def states_from(data: Mapping[str, Any]) -> RobotStates:
    """The states of which :func:`proofroll.files.json_data.plain` made this."""
    return RobotStates(**{field: _arrays(by_joint) for field, by_joint in data.items()})


def _arrays(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: np.array(item, dtype=float) if isinstance(item, list) else item for key, item in values.items()}
