"""The engine keeps every promise of the protocol, but for what its defaults are known to do."""

import pytest
from proofroll_pybullet.engine import Pybullet

from proofroll.conformance import checks

DAMPED = "by default the spin of PyBullet's links is damped"
KNOWN = {
    "moves_as_the_truth[plane-default-slow]": "damped as on the plane, and 1/240 s is long for a path that bends",
    "moves_as_the_truth[plane-default-fast]": "unless maxJointVelocity says more, PyBullet cuts spin to 100 rad/s",
    "moves_as_the_truth[spheres-default-sled]": "where three feet slide, friction is some ten degrees off the slip",
    "moves_as_the_truth[spheres-matched-sled]": "where three feet slide, friction is some ten degrees off the slip",
    "moves_as_the_truth[spheres-default-two_spheres]": "by default a body loses 4 % of its speed in a second",
    "first_steps_fit_the_scene[urdf-default-heavy_top]": DAMPED,
    "first_steps_fit_the_scene[urdf-default-slow_top]": DAMPED,
    "first_steps_fit_the_scene[urdf-default-double_pendulum-friction]": DAMPED,
    "first_steps_fit_the_scene[urdf-default-double_pendulum-servo]": DAMPED,
    "first_steps_fit_the_scene[urdf-default-double_pendulum-limit]": DAMPED,
    "first_steps_fit_the_scene[urdf-default-double_pendulum-target]": DAMPED,
    "moves_as_the_truth[urdf-default-slow_top]": DAMPED,
    "moves_as_the_truth[urdf-default-double_pendulum-friction]": DAMPED,
    "moves_as_the_truth[urdf-default-double_pendulum-limit]": DAMPED,
    "first_steps_fit_the_scene[urdf-default-double_pendulum-torque]": DAMPED,
    "first_steps_fit_the_scene[urdf-default-double_pendulum-damping]": DAMPED,
    "moves_as_the_truth[urdf-default-heavy_top]": DAMPED,
    "moves_as_the_truth[urdf-default-oscillators]": DAMPED,
    "moves_as_the_truth[urdf-default-double_pendulum-torque]": DAMPED,
    "moves_as_the_truth[urdf-default-double_pendulum-damping]": DAMPED,
}


@pytest.mark.parametrize("check", checks(Pybullet, KNOWN), ids=lambda check: check.name)
def test_engine(check):
    check()
