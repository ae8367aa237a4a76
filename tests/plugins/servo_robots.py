"""Robots of the gallery's packages with a position servo at every joint."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robot_gallery import locate

from proofroll.core.parameters import Parameters
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.reading.reader import made_mechanism
from proofroll.robots.scene import RobotScenes

# Part of a joint's name -> kp, kd and target; the first that fits counts.
SERVOS: Mapping[str, Mapping[str, tuple[float, float, float]]] = {
    "solo12": {
        "FL_HFE": (5, 0.2, 0.8),
        "FR_HFE": (5, 0.2, 0.8),
        "FL_KFE": (5, 0.2, -1.6),
        "FR_KFE": (5, 0.2, -1.6),
        "HFE": (5, 0.2, -0.8),
        "KFE": (5, 0.2, 1.6),
        "HAA": (5, 0.2, 0),
    },
    "g1": {"hip": (100, 2, 0), "knee": (150, 4, 0.3), "waist": (150, 3, 0), "ankle": (40, 2, -0.2), "": (40, 1.5, 0.1)},
}


def servo_tables(name: str, armature: float = 0.0, speed: float = 0.0) -> dict[str, Any]:
    """Tables of a scene of a robot that floats at its targets; the test is skipped where its package is not installed.

    ``speed``: largest random velocity of a joint [rad/s].
    """
    path = locate(name)
    values = {key: item["value"] for key, item in RobotScenes.content(path)["parameters"].items()}
    laws = {law: 0.0 for law in ("damping", "friction", "armature") if law in values}
    tables = RobotScenes.tables(path, values | {"free_base": 1, "speed": speed} | laws)
    for joint in tables["joints"]:
        if joint["kind"] == "free":
            joint |= {"q0": [0, 0, 1, 1, 0, 0, 0], "v0": [0] * 6}
            continue
        kp, kd, target = next(gains for part, gains in SERVOS[name].items() if part in joint["name"])
        joint |= {"q0": [target], "armature": armature}
        tables["actuators"].append(
            {
                "name": joint["name"],
                "joint": joint["name"],
                "kind": "position",
                "target": target,
                "kp": kp,
                "kd": kd,
            }
        )
    return {key: table for key, table in tables.items() if key not in {"gravity", "unmodelled", "couplings"}}


def servo_robot(name: str, armature: float = 0.0) -> Mechanism:
    """Mechanism of a robot that floats at its targets without gravity."""
    return made_mechanism(servo_tables(name, armature), (0.0, 0.0, 0.0), Parameters({}, {}))
