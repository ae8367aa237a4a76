"""What must follow when the parts of a mechanism are listed in another order, or have other names."""

from __future__ import annotations

import functools
import random

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from turned_scenes import shuffled

from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

# A coupling, two contacts of one body; a loop, three contacts of one body, contacts with an actuator.
QUICK, SLOW = ("gear_pair", "rocking_block"), ("slider_crank", "sled", "flick")


def run(scene: Scene) -> xr.Dataset:
    """Two steps of the scene, in the engine that is part of the project."""
    return simulate(scene, "projection[formulation=dependent]", until=2e-3, every=1e-3)


@functools.cache
def as_written(name: str) -> xr.Dataset:
    """The scene's run as its file has it."""
    return run(load_scene(name))


@pytest.mark.nightly
@pytest.mark.nightly_of("rocking_block", "flick")
@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.drill) for name in SLOW)])
@given(order=st.randoms(use_true_random=False))
def test_order_and_names_change_nothing(name: str, order: random.Random) -> None:
    """Bodies move alike, and joints and contacts bear alike, whatever the order and the names of all parts."""
    other, names = shuffled(load_scene(name), order)
    one, two = as_written(name), run(other)
    bodies = [names[body] for body in one["body"].to_numpy()]
    for quantity in ("p_WB", "v_WB", "w_WB", "q_WB"):
        expected, found = one[quantity].to_numpy(), two[quantity].sel(body=bodies).to_numpy()
        assert found == pytest.approx(expected, abs=1e-10 * max(1.0, float(np.abs(expected).max()))), quantity
    loads = [key for key in one if str(key).split(".")[0] in {"force", "torque", "gap", "slip"}]
    assert loads
    for key in map(str, loads):
        kind, of, *rest = key.split(".")
        expected, found = one[key].to_numpy(), two[".".join([kind, names[of], *rest])].to_numpy()
        size = max(1.0, float(np.abs(expected).max()))
        assert found == pytest.approx(expected, abs=1e-8 * size, nan_ok=True), key
