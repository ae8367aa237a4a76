"""Restitution of a ball in the engines that can be asked for it."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate


@pytest.mark.parametrize("e", [0.0, 1.0])
def test_dead_and_perfect_impacts(e: float) -> None:
    """With e = 0 the ball stays where it lands, with 1 it comes back to its height, in impulses as in truth."""
    scene = load_scene("bouncing_ball", restitution=e, height=0.3)
    true, found = (
        simulate(scene, name, until=0.6, every=0.02) for name in ("truth", "pinocchio[formulation=impulses]")
    )
    np.testing.assert_allclose(found["gap"], true["gap"], rtol=0, atol=5e-3)
