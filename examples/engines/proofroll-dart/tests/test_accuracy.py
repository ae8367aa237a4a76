"""Accuracy as README.md states it."""

import numpy as np
import pytest

import proofroll


def error(scene, engine, until, **settings):
    loaded = proofroll.load_scene(scene)
    true, found = (
        proofroll.simulate(loaded, text, until=until, every=until / 10, **more)["positions"].to_numpy()
        for text, more in (("truth", {}), (engine, settings))
    )
    return float(np.max(np.abs(found - true)))


@pytest.mark.parametrize("scene", ["double_pendulum", "oscillators"])
def test_its_accelerations_are_the_truths(scene):
    """Integrated closely enough, DART's forward dynamics is the truth."""
    assert error(scene, "dart[formulation=forward_dynamics]", 0.5) < 1e-8


@pytest.mark.parametrize("scene", ["double_pendulum", "oscillators"])
def test_its_own_steps_are_of_first_order(scene):
    """A tenth of the step leaves a tenth of the error."""
    coarse, fine = (error(scene, "dart[formulation=world]", 0.5, dt=dt) for dt in (5e-3, 5e-4))
    assert coarse / fine == pytest.approx(10, rel=0.15)
