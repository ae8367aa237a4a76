"""A robot file as a scene, released from a random pose under gravity.

Contacts and looks are left out; actuators of an MJCF act if the scene's parameter ``actuators`` is 1.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from proofroll.core.number_format import counted
from proofroll.robots.control.controlled import ControlledScenes
from proofroll.robots.files.opening import BASES
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.files.scene_tables import (
    ENDINGS,
    SWITCH,
    ParameterRow,
    described,
    held_start,
    keyframe_states,
    laws,
    read_robot,
    scene_actuators,
    tables_of,
)
from proofroll.robots.model import Robot
from proofroll.robots.states import random_states

_DURATION = 1.0  # s: an arm falls through much of its reach, and few are chaotic so early
_RELEASE: dict[str, ParameterRow] = {
    "seed": (0, "1", "which random pose and velocities the robot is released with", {"at_least": 0, "integer": True}),
    "speed": (1.0, "1", "largest random velocity of a joint in rad/s or m/s", {"at_least": 0}),
}


class RobotScenes:
    """Scenes from robot files; see :class:`proofroll.files.scene_sources.SceneSource`."""

    endings: ClassVar[tuple[str, ...]] = ENDINGS

    @staticmethod
    def under(control: Path) -> Any:
        """See :class:`proofroll.files.scene_sources.TakesControllers`."""
        return ControlledScenes(control)

    @staticmethod
    def content(path: Path) -> dict[str, Any]:
        """Title, source and parameters of a robot's scene."""
        file, robot = read_robot(path, "fixed")
        parameters = dict(_RELEASE) | _parameters(file, robot)
        if robot.actuators:
            words = "whether the file's actuators act, with their controls at zero (1), or not (0)"
            parameters["actuators"] = (0, "1", words, SWITCH)
        if file.keyframes:
            words = "number of the file's keyframe that gives start and controls (0: a random start, controls at zero)"
            parameters["keyframe"] = (0, "1", words, {"at_least": 0, "at_most": len(file.keyframes), "integer": True})
        return {
            "title": f"{robot.name}, released from a random pose",
            "reason": "How engines move this robot",
            "duration": _DURATION,
        } | described(file, parameters)

    @staticmethod
    def tables(path: Path, values: Mapping[str, float]) -> dict[str, Any]:
        """Tables of the scene for these values of its parameters: gravity, bodies, joints, points and the rest.

        Raises:
            InputError: nothing in the file moves, or a link has an impossible inertia.
        """
        file, robot = read_robot(path, BASES[int(values.get("free_base", 0))])
        number_of_keyframe = int(values.get("keyframe", 0))
        keyframe = file.keyframes[number_of_keyframe - 1] if number_of_keyframe else None
        controls = keyframe.ctrl if keyframe else ()
        acting, silent = scene_actuators(robot, controls) if values.get("actuators") else ([], [])
        clauses = [f"{what} (actuators=0 leaves all out)" for what in silent]
        start = keyframe_states(robot, keyframe) if keyframe else random_states(robot, 1, int(values["seed"]))
        start = held_start(robot, start) if values["couplings"] and not keyframe else start
        tables = tables_of(file, robot, start, values)
        drives = [f"{counted(len(file.driven), 'transmissions')} (--control)"] if file.driven else []
        omitted = [*drives, *tables["omitted"]]
        return tables | {"actuators": acting, "unmodelled": [*clauses, *tables["unmodelled"]], "omitted": omitted}

    @staticmethod
    def judge_record(
        record: Path, robot: Path, control: Path | None, names: Mapping[str, str] | None = None, layout: str = ""
    ) -> Any:
        """See :class:`proofroll.files.scene_sources.JudgesRecords`."""
        from proofroll.robots.control.judge import judge_record

        return judge_record(record, robot, control, names, layout)

    @staticmethod
    def probe_start(path: Path, *, free: bool) -> Any:
        """See :class:`proofroll.files.scene_sources.StartsProbes`."""
        from proofroll.robots.control.probe_start import probe_start

        return probe_start(path, free=free)


def _parameters(file: RobotFile, robot: Robot) -> dict[str, ParameterRow]:
    """Parameters of a robot but for its start and its actuators."""
    gravity = float(np.linalg.norm(robot.gravity))
    parameters: dict[str, ParameterRow] = {"gravity": (gravity, "m/s^2", "acceleration of gravity", {"at_least": 0})}
    if file.kind == "urdf":
        parameters["free_base"] = (0, "1", "whether nothing holds the root (1), or the world does (0)", SWITCH)
    return parameters | laws(robot)
