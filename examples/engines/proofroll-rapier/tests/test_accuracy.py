"""Accuracy as README.md states it, and what is refused."""

import numpy as np
import pytest
from proofroll_rapier.engine import Rapier

import proofroll


def off(name, formulation, until, dt=1e-3):
    """Largest distance of a tracked place from the truth [m]."""
    scene = proofroll.load_scene(name)
    true = proofroll.simulate(scene, until=until, every=until / 10)["positions"].to_numpy()
    run = proofroll.simulate(scene, Rapier, until=until, every=until / 10, dt=dt, formulation=formulation)
    return float(np.max(np.abs(run["positions"].to_numpy() - true)))


@pytest.mark.parametrize(
    ("scene", "formulation", "until", "error"),
    [
        ("pendulum", "multibody", 0.5, 9.0e-5),
        ("pendulum", "impulse", 0.5, 3.4e-4),
        ("four_bar", "impulse", 0.5, 9.2e-5),
        ("four_bar", "multibody", 0.5, 7.8e-7),
        ("servo", "multibody", 0.5, 4.2e-4),
        ("stop", "multibody", 0.7, 8.8e-5),
        ("falling_rod", "impulse", 0.5, 8.7e-5),
        ("heavy_top", "impulse", 0.3, 3.5e-4),
        ("arm_pd", "multibody", 0.5, 7.2e-5),
    ],
)
def test_errors_are_those_of_the_table(scene, formulation, until, error):
    """A place is as far from the truth as the table says at a step of 1 ms, within a third for other processors."""
    assert off(scene, formulation, until) == pytest.approx(error, rel=0.35)


@pytest.mark.parametrize("scene", ["double_pendulum", "servo", "arm_pd"])
def test_multibodies_are_of_first_order(scene):
    """Half the step leaves half the error, far above the round-off of single precision."""
    assert off(scene, "multibody", 0.5, 2e-3) / off(scene, "multibody", 0.5, 1e-3) == pytest.approx(2, rel=0.1)


def test_friction_of_three_feet_is_aside():
    """A sled on three feet is led millimetres aside at any step: each of two tangents has a response of its own."""
    coarse, fine = off("sled", "impulse", 0.3), off("sled", "impulse", 0.3, 2.5e-4)
    assert 5e-3 < fine < 1e-2
    assert coarse == pytest.approx(fine, rel=0.05)


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        ("pendulum_friction", "no dry friction"),
        ("gear_pair", "no gears"),
        ("andrews_squeezer", "no springs between points"),
        ("rattleback", "needs contact of ellipsoids"),
    ],
)
def test_what_it_has_not_is_refused_with_the_reason(scene, reason):
    """Laws and shapes that are not built are refused before anything moves."""
    with pytest.raises(proofroll.Refused, match=reason):
        proofroll.simulate(proofroll.load_scene(scene), Rapier, until=0.1, every=0.1)


def test_a_multibody_starts_as_the_scene_does():
    """A spinning top on a ball joint starts as the scene says, though a multibody begins at zero."""
    scene = proofroll.load_scene("heavy_top")
    start = scene.elements[0].start
    sample = Rapier.build(scene, Rapier.presets["multibody"]["matched"]).sample()
    assert np.allclose(sample.w_WB, start.w_WB[0], rtol=1e-6)
    assert np.allclose(sample.q_WB, start.q_WB[0], atol=1e-6)
