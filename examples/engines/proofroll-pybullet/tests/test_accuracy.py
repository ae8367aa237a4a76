"""Accuracy as README.md states it."""

import numpy as np
import pytest

import proofroll

SCENE, UNTIL, EVERY = "sphere_in_cylinder", 1.0, 0.02
STEPS = (5e-4, 2.5e-4, 1.25e-4)


def height(**settings):
    scene = proofroll.load_scene(SCENE)
    return proofroll.simulate(scene, "pybullet", until=UNTIL, every=EVERY, **settings)["z"].to_numpy()


def test_the_limit_of_small_steps_is_the_truth():
    """Its contact is of first order, 1.2e-2 m off at a millisecond, and its limit is the truth to a micrometre."""
    true = proofroll.simulate(proofroll.load_scene(SCENE), until=UNTIL, every=EVERY)["z"].to_numpy()
    assert np.max(np.abs(height(dt=1e-3) - true)) == pytest.approx(1.2e-2, rel=0.05)
    coarse, middle, fine = (height(dt=dt) for dt in STEPS)
    first, second = 2 * middle - coarse, 2 * fine - middle
    assert np.max(np.abs((4 * second - first) / 3 - true)) < 1e-6


@pytest.mark.parametrize(("scene", "until"), [("double_pendulum", 0.5), ("heavy_top", 0.2), ("bricard", 0.2)])
def test_mechanisms_are_of_first_order(scene, until):
    """A tenth of the step leaves a tenth of the error, in a tree, in a ball joint and in a loop in space."""
    loaded = proofroll.load_scene(scene)
    true = proofroll.simulate(loaded, until=until, every=until / 10)["positions"].to_numpy()
    errors = [
        np.max(np.abs(proofroll.simulate(loaded, "pybullet", until=until, every=until / 10, dt=dt)["positions"] - true))
        for dt in (until / 200, until / 2000)
    ]
    assert float(errors[0] / errors[1]) == pytest.approx(10, rel=0.15)


def test_what_it_cannot_do_it_says():
    """Springs between points are refused with the reason."""
    with pytest.raises(proofroll.Refused, match="no springs between points"):
        proofroll.simulate(proofroll.load_scene("andrews_squeezer"), "pybullet[formulation=urdf]", until=0.1, every=0.1)


@pytest.mark.parametrize(("scene", "until", "bound"), [("two_spheres", 0.2, 1e-3), ("spinning_bounce", 0.6, 5e-3)])
def test_impacts_with_spin_come_near_the_truth(scene, until, bound):
    """Spheres that hit with spin rebound as Coulomb's and Newton's laws say, to the first order of a step."""
    loaded = proofroll.load_scene(scene)
    true = proofroll.simulate(loaded, until=until, every=until / 10)["positions"]
    run = proofroll.simulate(loaded, "pybullet[formulation=spheres]", until=until, every=until / 10, dt=1e-3)
    assert float(np.abs(run["positions"] - true).max()) < bound


def test_friction_of_three_feet_is_aside():
    """A sled on three feet is led some millimetres aside by a cone whose rows are found one by one."""
    loaded = proofroll.load_scene("sled")
    true = proofroll.simulate(loaded, until=0.4, every=0.04)["positions"]
    run = proofroll.simulate(loaded, "pybullet[formulation=spheres]", until=0.4, every=0.04, dt=1e-3)
    assert 2e-3 < float(np.abs(run["positions"] - true).max()) < 0.1
