"""Copies that move together: each is held against its own truth."""

import numpy as np
import pytest
from proofroll_mjx.engine import Mjx
from proofroll_mjx.settings import MjxSettings

import proofroll

ANGLES = np.linspace(0.5, 2.5, 8)


def errors(settings, copies):
    """Distance of the lower rod of each copy from its truth after 1 s [m], and the index of its start."""
    scenes = [proofroll.load_scene("double_pendulum", angle=float(angle)) for angle in ANGLES]
    pattern = [number % len(scenes) for number in range(copies)]
    batch = Mjx.build_batch(scenes, pattern, settings)
    batch.advance(1.0)
    true = [proofroll.simulate(scene, until=1.0, every=1.0)["p_WB"].to_numpy()[-1, 1] for scene in scenes]
    return np.linalg.norm(batch.sample().p_WB[:, 1] - np.array(true)[pattern], axis=1), np.array(pattern)


@pytest.mark.nightly
@pytest.mark.parametrize(("integrator", "low", "high"), [("Euler", 5e-3, 5e-2), ("RK4", 1e-10, 1e-8)])
def test_the_worst_copy_is_not_the_first(integrator, low, high):
    """The worst copy has the error of the integrator, many times that of the first one; twins have the same bits."""
    error, pattern = errors(MjxSettings(integrator=integrator), 16)
    assert low < error.max() < high
    assert error.max() > 5 * error[0]
    assert all(np.ptp(error[pattern == index]) == 0 for index in range(len(ANGLES)))


def test_scenes_of_another_structure_are_refused():
    """One function moves the copies, so that their scenes have the same joints."""
    scenes = [proofroll.load_scene(name) for name in ("pendulum", "double_pendulum")]
    with pytest.raises(proofroll.Refused, match="copies of one structure"):
        Mjx.build_batch(scenes, [0, 1], MjxSettings())
