"""Accuracy as README.md states it, and what is refused."""

import numpy as np
import pytest
from proofroll_mujoco_warp.engine import MujocoWarp

import proofroll


def off(name, formulation, quantity="positions"):
    """Largest difference of a quantity from the truth over 0.5 s at a step of 1 ms."""
    scene = proofroll.load_scene(name)
    true = proofroll.simulate(scene, until=0.5, every=0.05)[quantity].to_numpy()
    run = proofroll.simulate(scene, MujocoWarp, until=0.5, every=0.05, dt=1e-3, formulation=formulation)
    return float(np.max(np.abs(run[quantity].to_numpy() - true)))


@pytest.mark.nightly
@pytest.mark.parametrize("formulation", ["euler"])
@pytest.mark.parametrize(
    ("scene", "quantity", "error"),
    [("pendulum", "positions", 1.8e-3), ("four_bar", "w_WB", 4.0e-3), ("servo", "positions", 4.8e-3)],
)
def test_errors_are_those_of_the_first_order_step(scene, quantity, error, formulation):
    """MuJoCo's Euler step leaves half a step times the acceleration, whoever computes it."""
    assert off(scene, formulation, quantity) == pytest.approx(error, rel=0.02)


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        ("falling_rod", "builds no contacts"),
        ("pendulum_friction", "how soft dry friction is"),
        ("gear_pair", "no gears"),
        ("andrews_squeezer", "no springs between points"),
    ],
)
def test_what_it_has_not_is_refused_with_the_reason(scene, reason):
    """Laws that are not built are refused before anything is compiled."""
    with pytest.raises(proofroll.Refused, match=reason):
        proofroll.simulate(proofroll.load_scene(scene), MujocoWarp, until=0.1, every=0.1)
