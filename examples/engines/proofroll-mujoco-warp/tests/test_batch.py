"""Worlds that move together: each is held against its own truth."""

import numpy as np
import pytest
from proofroll_mujoco_warp.engine import MujocoWarp
from proofroll_mujoco_warp.settings import MujocoWarpSettings

import proofroll

ANGLES = np.linspace(0.5, 2.5, 8)


@pytest.mark.nightly
def test_the_worst_copy_is_not_the_first():
    """The worst copy has the error of the Euler step, many times that of the first one; twins have the same bits."""
    scenes = [proofroll.load_scene("double_pendulum", angle=float(angle)) for angle in ANGLES]
    pattern = np.arange(16) % len(scenes)
    batch = MujocoWarp.build_batch(scenes, pattern.tolist(), MujocoWarpSettings())
    batch.advance(1.0)
    true = [proofroll.simulate(scene, until=1.0, every=1.0)["p_WB"].to_numpy()[-1, 1] for scene in scenes]
    error = np.linalg.norm(batch.sample().p_WB[:, 1] - np.array(true)[pattern], axis=1)
    assert 5e-3 < error.max() < 5e-2
    assert error.max() > 5 * error[0]
    assert all(np.ptp(error[pattern == index]) == 0 for index in range(len(ANGLES)))


@pytest.mark.nightly
def test_scenes_of_another_structure_are_refused():
    """Worlds share the tree of bodies."""
    scenes = [proofroll.load_scene(name) for name in ("pendulum", "double_pendulum")]
    with pytest.raises(proofroll.Refused, match="worlds of MuJoCo Warp share"):
        MujocoWarp.build_batch(scenes, [0, 1], MujocoWarpSettings())
