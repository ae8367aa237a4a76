"""A start that slips, in every formulation of bodies that follows it."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

# Thrown and spinning across, on a slope; MuJoCo has no rolling resistance beside slip.
THROWN = {"cross_speed": 0.3, "side_spin": 40, "normal_spin": 9, "tilt": 0.1}
RESISTED: dict[str, Any] = {**THROWN, "rolling_resistance": 5e-4}
# Start, engine, and what it leaves of speed [m/s] and of the time at which it rolls [s]: three times what was measured.
ENGINES = [
    pytest.param(RESISTED, "projection[formulation=dependent]", 1e-12, 1e-11, marks=pytest.mark.drill),
    (RESISTED, "pinocchio[formulation=impulses]", 5e-4, 1e-3),
    pytest.param(RESISTED, "pinocchio[formulation=impulses,preset=tuned]", 5e-4, 1e-3, marks=pytest.mark.drill),
    pytest.param(RESISTED, "exudyn[formulation=spheres]", 1e-3, 1e-3, marks=pytest.mark.drill),
    (THROWN, "mujoco[formulation=geoms,preset=tuned]", 1e-3, 1e-3),
]


@cache
def true(resists: bool) -> tuple[Scene, xr.Dataset]:
    """Scene and truth."""
    scene = load_scene("slide_to_roll", **(RESISTED if resists else THROWN))
    return scene, simulate(scene, "truth", until=0.6, every=0.05)


@pytest.mark.one_in(3)
@pytest.mark.drill_of("start1-pinocchio[formulation=impulses]-0.0005-0.001")
@pytest.mark.parametrize(("start", "engine", "speed", "time"), ENGINES)
def test_slip_that_turns(start: dict[str, Any], engine: str, speed: float, time: float) -> None:
    """The ball slips from time 0 on, in a direction that turns, and sticks when the truth does."""
    scene, expected = true("rolling_resistance" in start)
    found = simulate(scene, engine, until=0.6, every=0.05)
    assert found.attrs["status"] == "done"
    assert [event.kind for event in events_of(found)] == ["stick"]
    (end,), (right,) = events_of(found), events_of(expected)
    assert end.time == pytest.approx(right.time, abs=time)
    assert end.time_high - end.time_low <= 2 * time
    for name in ("down_rate", "across_rate"):
        np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=speed)
