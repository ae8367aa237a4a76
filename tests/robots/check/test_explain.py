"""The search for causes: how much of a robot's motion it evaluates, and what it may not believe."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robot_templates import inertial, urdf

from proofroll.robots.check import layers
from proofroll.robots.check.explain import Search
from proofroll.robots.check.layers import LAYERS, RobotTruth
from proofroll.robots.check.two_files import reading_of
from proofroll.robots.check.two_formulations import Dynamics
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.files.urdf import read_urdf
from proofroll.robots.model import Robot
from proofroll.robots.states import random_states

STATES = 100
TOLERANCES = dict.fromkeys(LAYERS, 1e-10) | {"joints": 0.0}
BOTH = '<dynamics damping="0.7" friction="0.4"/>'
# An inertia that no body has, and one whose axes are turned: occasions for many hypotheses.
TEXT = urdf(first=BOTH, third=BOTH, tip=inertial(ixx="0.01", iyy="0.01", izz="0.9", rpy="0.3 0.2 1.1"))


@pytest.fixture
def evaluated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many states each evaluation of a robot's motion had."""
    counts: list[int] = []
    whole = layers.world_jacobians

    def counting(*given: Any) -> Dynamics:
        found = whole(*given)
        counts.append(len(found.M))
        return found

    monkeypatch.setattr(layers, "world_jacobians", counting)
    return counts


def _opened(folder: Path) -> tuple[RobotFile, RobotTruth]:
    path = folder / "robot.urdf"
    path.write_text(TEXT)
    file = open_robot(path)
    robot = read_urdf(file)
    return file, RobotTruth.of(robot, random_states(robot, STATES, 1))


def _lighter(robot: Robot) -> Robot:
    body = robot.bodies["tip"]
    return robot.with_bodies([dataclasses.replace(body, mass=0.9 * body.mass)])


def _unlawful(robot: Robot) -> Robot:
    """Without damping and friction, and with the file's moments in the axes of the link."""
    written = robot.sources["tip"]["written"]
    turned = robot.with_bodies([dataclasses.replace(robot.bodies["tip"], inertia=written)])
    return turned.with_joints(damping=0.0, friction=0.0)


@pytest.mark.parametrize(
    ("held", "ids", "left"),
    [
        (_unlawful, {"inertial_rotation_ignored", "damping_left_out", "friction_left_out"}, None),
        (_lighter, set(), "mass"),
    ],
    ids=["explained", "unexplained"],
)
def test_hypotheses_are_tried_at_a_few_states(
    held: Callable[[Robot], Robot], ids: set[str], left: str | None, evaluated: list[int], tmp_path: Path
) -> None:
    """All states are evaluated once for a cause that changes the motion; others cost a few, or none."""
    file, truth = _opened(tmp_path)
    reading = reading_of(held(truth.robot), truth)
    evaluated.clear()
    causes, unexplained = Search(file, reading, "planted", TOLERANCES).causes(truth)
    assert ({cause.id for cause in causes}, unexplained) == (ids, left)
    assert len([count for count in evaluated if count == STATES]) == len(ids & {"inertial_rotation_ignored"})
    assert all(count in (2, STATES) for count in evaluated)
    assert left is None or len(evaluated) == 1  # a mass that no cause explains refutes them all before they move
    assert all(cause.after < cause.before for cause in causes)


def test_what_holds_at_a_few_states_is_proven_at_all(tmp_path: Path) -> None:
    """An engine that is off at one late state alone is not excused by a cause that closes the first ones."""
    file, truth = _opened(tmp_path)
    reading = reading_of(truth.robot.with_joints(damping=0.0, friction=0.0), truth)
    assert reading.forward is not None
    reading.forward[-1] += 0.5
    _, unexplained = Search(file, reading, "planted", TOLERANCES).causes(truth)
    assert unexplained == "forward dynamics"


@pytest.mark.parametrize("shape", ['<sphere radius=" "/>', '<box size="1 2"/>', "<box/>", '<box size="1 b 2"/>'])
def test_a_shape_without_size_gives_no_cause(shape: str, tmp_path: Path) -> None:
    """Sizes of shapes are read by hypotheses alone: what is none ends no search."""
    path = tmp_path / "robot.urdf"
    path.write_text(TEXT.replace("</inertial>", f"</inertial><collision><geometry>{shape}</geometry></collision>"))
    file = open_robot(path)
    robot = read_urdf(file)
    truth = RobotTruth.of(robot, random_states(robot, 2, 1))
    causes, left = Search(file, reading_of(_lighter(robot), truth), "planted", TOLERANCES).causes(truth)
    assert (causes, left) == ((), "mass")


@pytest.mark.parametrize("engine", ["pinocchio", "planted"])
def test_a_possible_inertia_that_is_incomplete_is_called_incomplete(engine: str, tmp_path: Path) -> None:
    """An inertia without its zeros, which an engine reads as none, is named so; it is not called impossible."""
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(tip=inertial().replace('ixz="0.002" iyz="-0.001"', ""), tool=inertial()))
    file = open_robot(path)
    robot = read_urdf(file)
    truth = RobotTruth.of(robot, random_states(robot, 2, 1))
    assert not robot.bodies["tip"].impossible
    held = robot.with_bodies([dataclasses.replace(robot.bodies["tip"], inertia=np.zeros((3, 3)))])
    causes, left = Search(file, reading_of(held, truth), engine, TOLERANCES).causes(truth)
    assert ([cause.id for cause in causes], left) == (["incomplete_inertia_zeroed"], None)
