"""Scenes with numbers that other programs or closed forms published: the truth meets them."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.truth import truth
from proofroll.elements.mechanism.rotations import from_quaternion
from proofroll.files.scene_file import load_scene
from proofroll_drill.published import of_scene, tables

QUICK = {"falling_screw"}
# Meijaard, Papadopoulos, Ruina, Schwab 2007: the roots at 5 m/s.
ROOTS = np.array([-14.0783896927982, -0.3228664296, -0.7753418818 - 4.4648677130j, -0.7753418818 + 4.4648677130j])


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.drill) for name in tables()]
)
def test_a_truth_meets_what_peers_published(name: str) -> None:
    """Each published number of the scene, of an instant or a series, is the true one to its digits."""
    rows = [row for entry in tables()[name] for row in of_scene(name, entry)]
    assert [row.text for row in rows if row.misses] == []


@pytest.mark.drill
def test_a_bicycle_leans_as_published() -> None:
    """The roll is the angle of the frame's lateral axis from the level: three published instants, to 1e-12 rad."""
    found = truth(load_scene("bicycle"), np.array([0.0, 0.5, 1.0, 2.0]))
    rolls = [np.arcsin(from_quaternion(q)[2, 1]) for q in found["q_WB"].to_numpy()[1:, 0]]
    assert rolls == pytest.approx([0.1056094344262, -0.0412938697178, 0.0561808086960], abs=1e-12)


@pytest.mark.drill
def test_small_motions_of_a_bicycle_have_the_published_roots() -> None:
    """At 5 m/s a lean of 1e-4 rad/s is a sum of the four published exponentials."""
    times = np.linspace(0.0, 1.0, 41)
    found = truth(load_scene("bicycle", speed=5.0, rate=1e-4), times)
    motion = np.column_stack([np.exp(root * times) for root in ROOTS])
    steer = found["q.steer"].to_numpy()
    left = steer - motion @ np.linalg.lstsq(motion, steer.astype(complex), rcond=None)[0]
    assert np.abs(left).max() < 1e-8 * np.abs(steer).max()
