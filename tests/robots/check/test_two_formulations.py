"""What is true of a robot at a state."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from robot_templates import urdf
from scipy.spatial.transform import Rotation

from proofroll.files.json_data import plain
from proofroll.robots.check.body_recursion import body_recursion
from proofroll.robots.check.layers import RobotTruth
from proofroll.robots.check.two_formulations import world_jacobians
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.reading import robot_from, states_from
from proofroll.robots.files.urdf import read_urdf
from proofroll.robots.model import NO_BODY, Robot, RobotBody, RobotJoint
from proofroll.robots.states import random_states

KINDS = ["revolute", "prismatic", "spherical", "fixed", "revolute", "revolute", "spherical", "prismatic", "fixed"]


def _tree(base: str, seed: int, kinds: list[str] = KINDS) -> Robot:
    """A tree with every kind of joint, all numbers random."""
    random = np.random.default_rng(seed)
    bodies, joints = {}, []
    for index, kind in enumerate([base, *kinds]):
        name, free = f"b{index}", kind == "free"
        A = random.normal(size=(3, 3))
        bodies[name] = RobotBody(name, random.uniform(0.5, 2), random.normal(size=3), A @ A.T + 0.1 * np.eye(3))
        axis = random.normal(size=3)
        parent = f"b{random.integers(index)}" if index else NO_BODY
        place, at = (np.zeros(3), np.zeros(3)) if free else random.normal(size=(2, 3))
        turn = np.eye(3) if free else np.asarray(Rotation.random(rng=random).as_matrix())
        axis /= np.linalg.norm(axis)
        joints.append(RobotJoint(f"j{index}", kind, parent, name, place, turn, axis, at, armature=0.1 * index))
    return Robot("tree", bodies, tuple(joints))


@pytest.mark.parametrize("base", ["fixed", "free", "spherical"])
@pytest.mark.parametrize("seed", range(4))
def test_formulations_agree(base: str, seed: int) -> None:
    """World Jacobians and body-frame recursion give the same M, g and h on a tree with every kind of joint."""
    robot = _tree(base, seed)
    states = random_states(robot, 3, seed)
    one, other = world_jacobians(robot, states), body_recursion(robot, states)
    for name in ("M", "g", "h"):
        a, b = getattr(one, name), getattr(other, name)
        assert np.abs(a - b).max() < 1e-13 * np.abs(b).max()


def test_pendulum() -> None:
    """A pendulum with armature has the mass matrix and torques of the textbook."""
    mass, length, moment, armature, q = 1.3, 0.7, 0.05, 0.2, 0.4
    rod = RobotBody("rod", mass, np.array([0.0, 0.0, -length]), np.diag([moment, moment, 0.001]))
    axis = np.array([0.0, 1.0, 0.0])
    hinge = RobotJoint("hinge", "revolute", NO_BODY, "rod", np.zeros(3), np.eye(3), axis, armature=armature)
    robot = Robot("pendulum", {"rod": rod}, (hinge,))
    states = random_states(robot, 1, 0)
    states = dataclasses.replace(states, angle={"hinge": np.array([q])})
    found = world_jacobians(robot, states)
    assert found.M[0, 0, 0] == pytest.approx(mass * length**2 + moment + armature, rel=1e-14)
    assert found.g[0, 0] == pytest.approx(mass * 9.81 * length * np.sin(q), rel=1e-14)
    assert found.h[0, 0] == pytest.approx(found.g[0, 0], rel=1e-14)


@pytest.mark.parametrize("base", ["fixed", "free"])
def test_power(base: str) -> None:
    """Without gravity and torques the kinetic energy does not change: v·M·a + v·dM/dt·v / 2 = 0."""
    rates = [kind for kind in KINDS if kind != "spherical"]  # whose velocities are the rates of coordinates
    robot = _tree(base, 7, rates).change(gravity=np.zeros(3))
    states, step = random_states(robot, 1, 3), 1e-5
    found = world_jacobians(robot, states)
    v = states.stacked(states.velocity, robot)[0]
    a = -np.linalg.solve(found.M[0], found.h[0])

    def moved(time: float) -> float:
        angle = {name: q + time * states.velocity[name][:, 0] for name, q in states.angle.items()}
        position = {name: p + time * states.velocity[name][:, :3] for name, p in states.position.items()}
        rotation = {
            name: Rotation.from_rotvec(time * states.velocity[name][:, 3:]).as_matrix() @ R
            for name, R in states.rotation.items()
        }
        there = dataclasses.replace(states, angle=angle, position=position, rotation=rotation)
        return float(v @ world_jacobians(robot, there).M[0] @ v)

    change = (moved(step) - moved(-step)) / (2 * step)
    energy = float(v @ found.M[0] @ v)
    assert abs(v @ found.M[0] @ a + change / 2) < 1e-7 * energy


def test_link_called_world(tmp_path: Path) -> None:
    """A link that is called world is a link like any other, also on a free base."""
    models = []
    for name in ("base", "world"):
        path = tmp_path / f"{name}.urdf"
        path.write_text(urdf().replace('"base"', f'"{name}"'))
        robot = read_urdf(open_robot(path, "free"))
        states = random_states(robot, 2, 0)
        found = world_jacobians(robot, states)
        assert np.abs(found.M - body_recursion(robot, states).M).max() < 1e-12
        models.append(found.M)
    assert np.array_equal(*models)


def test_plain_data_round_trip() -> None:
    """A robot and its states come back from plain data bit for bit."""
    robot = _tree("free", 1)
    states = random_states(robot, 2, 1)
    again, there = robot_from(plain(robot)), states_from(plain(states))
    assert np.array_equal(world_jacobians(again, there).M, world_jacobians(robot, states).M)


def test_singular_mass_matrix() -> None:
    """A joint that moves no mass makes the mass matrix singular, and an ordinary robot's is not."""
    robot = _tree("fixed", 2)
    assert not RobotTruth.of(robot, random_states(robot, 2, 0)).dynamics.singular
    empty = RobotBody("end", 0.0, np.zeros(3), np.zeros((3, 3)))
    joint = RobotJoint("last", "revolute", "b0", "end", np.zeros(3), np.eye(3), np.array([0.0, 0.0, 1.0]))
    robot = robot.change(bodies={**robot.bodies, "end": empty}, joints=(*robot.joints, joint))
    assert RobotTruth.of(robot, random_states(robot, 2, 0)).dynamics.singular
