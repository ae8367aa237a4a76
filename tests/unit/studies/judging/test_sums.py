"""Sums of contact forces that equations determine, though they determine no single one of them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import proofroll
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene

TIMES = np.linspace(0.0, 0.2, 5)


@pytest.fixture(scope="module")
def resting() -> tuple[Scene, xr.Dataset]:
    """A sled on three feet that rests: friction of its feet is not determinate, their sum is."""
    scene = load_scene("sled", speed=0.0, cross_speed=0.0, spin=0.0)
    return scene, truth(scene, TIMES)


TURNS = [[0, 0.3, 0], [0, 0, 0], [0, -0.3, 0]]  # of the left, the right and the back foot, a pair without a sum
LITTLE = [[0, 0.01, 0], [0, 0, 0], [0, -0.01, 0]]


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("off", "agrees"),
    [((0, 0, 0), True), ((0.3, 0, 0), False), ((0.03, 0.03, 0.03), True), (TURNS, False), (LITTLE, True)],
)
def test_the_sum_of_what_is_not_determinate_is_judged(
    resting: tuple[Scene, xr.Dataset], off: tuple[object, ...], agrees: bool
) -> None:
    """Friction on the feet of what rests that pushes or turns it is made by nothing; little of it is within 1 %."""
    scene, true = resting
    forces = np.nan_to_num(true.contact_forces.to_numpy()) + np.array(off)
    run = {name: true[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB", "q_WB")}
    found = proofroll.judge({"time": TIMES, **run, "contact_force": forces}, scene)
    assert found.agrees is agrees, str(found)
    assert {"net_forces", "net_torques"} <= {item.judgement.observable for item in found.compared}
