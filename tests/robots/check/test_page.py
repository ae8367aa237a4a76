"""Picture of a robot on the page of a check."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from proofroll.robots.check.check import robot_drawing
from proofroll.robots.check.page import page, skeleton
from proofroll.robots.check.records import DrawnRobot, RobotCheck, UsedTruth
from proofroll.robots.model import NO_BODY, Robot, RobotBody, RobotJoint


def pendulum(length: float, joints: int = 1) -> DrawnRobot:
    """Rods one below the other, each of which turns about the world's y axis at its upper end."""
    bodies, drives = {}, []
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    for number in range(joints):
        name = f"rod{number}"
        bodies[name] = RobotBody(name, 2.0, np.array([length / 2, 0, 0]), np.eye(3))
        above = f"rod{number - 1}" if number else NO_BODY
        place = np.array([length, 0, 0]) if number else np.zeros(3)
        rotation = np.eye(3) if number else turn
        drives.append(RobotJoint(f"j{number}", "revolute", above, name, place, rotation, np.array([0.0, 1, 0])))
    return robot_drawing(SimpleNamespace(robot=Robot("pendulum", bodies, tuple(drives))))


def check_of(robot: DrawnRobot) -> RobotCheck:
    """A check without engines."""
    return RobotCheck("robot.urdf", "urdf", "fixed", [], UsedTruth("us", 0.0, 1, 0, 1), {}, [], robot)


def test_drawing_has_axes_and_centres_of_mass_in_the_world() -> None:
    """The second rod turns one length below the first, and its centre of mass is half a length below that."""
    drawn = pendulum(0.4, joints=2)
    assert drawn.joints[1].position == pytest.approx([0, 0, -0.4])
    assert drawn.joints[1].axis == pytest.approx([0, 1, 0])
    assert drawn.bodies["rod1"].centre == pytest.approx([0, 0, -0.6])


@pytest.mark.parametrize("length", [1e-4, 0.3, 40.0])
@pytest.mark.parametrize("joints", [1, 2])
def test_a_robot_of_any_size_fills_its_picture(length: float, joints: int) -> None:
    """A robot of one body is no dot in the middle: joints, axes and centres of mass reach across the square."""
    found = skeleton(check_of(pendulum(length, joints)))
    points = [line["at"] for line in found["lines"]] + [centre["at"] for centre in found["centres"]]
    points += [end for axis in found["axes"] for end in axis["ends"]]
    assert np.ptp(np.array(points), axis=0).max() == pytest.approx(0.84 * found["size"], abs=0.2)
    assert np.min(points) >= 0
    assert np.max(points) <= found["size"]
    assert (len(found["axes"]), len(found["centres"])) == (joints, joints)


def test_page_names_axes_and_centres_of_mass() -> None:
    """The picture names what the pointer is on, with the mass."""
    html = page(check_of(pendulum(0.3)))
    assert "axis of j0 (revolute)" in html
    assert "centre of mass of rod0, 2 kg" in html
