"""A start that slips, in every formulation that bounds friction."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.core.errors import Refused
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

# Engine, then what it leaves of speed [m/s] and of the time at which it rolls [s]: three times what was measured. The
# projection method in Euler angles, three times as dear, is held against the frame in test_projection_slip.
ENGINES = [
    ("projection[formulation=rotating_frame]", 1e-12, 1e-11),
    ("projection[formulation=rotating_frame,preset=default]", 1e-5, 1e-5),
    ("pinocchio[formulation=composite]", 1e-12, 1e-11),
    ("pinocchio[formulation=free_flyer]", 1e-12, 1e-11),
    ("pinocchio[formulation=composite,preset=default]", 5e-4, 1e-3),
    ("pinocchio[formulation=contact]", 2e-4, 1e-3),
    ("exudyn[formulation=generic,preset=default]", 5e-6, 1e-5),
    ("exudyn[formulation=contact]", 1e-5, 1e-5),
    ("mujoco[formulation=chart,preset=tuned]", 3e-4, 2e-3),
    ("mujoco[formulation=free,preset=tuned]", 3e-4, 2e-3),
]


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Thrown and spinning across, on a slope that resists rolling."""
    return load_scene("slide_to_roll", cross_speed=0.3, side_spin=40, normal_spin=9, tilt=0.1, rolling_resistance=5e-4)


@pytest.fixture(scope="module")
def true(scene: Scene) -> xr.Dataset:
    """Its truth."""
    return simulate(scene, "truth", until=0.6, every=0.05)


@pytest.mark.parametrize(("engine", "speed", "time"), ENGINES)
def test_slip_that_turns(engine: str, speed: float, time: float, scene: Scene, true: xr.Dataset) -> None:
    """The ball slips from time 0 on, in a direction that turns, and sticks when the truth does."""
    found = simulate(scene, engine, until=0.6, every=0.05)
    assert found.attrs["status"] == "done"
    assert [event.kind for event in events_of(found)] == ["slip", "stick"]
    assert events_of(found)[0].time == 0
    assert events_of(found)[1].time == pytest.approx(events_of(true)[1].time, abs=time)
    for name in ("down_rate", "across_rate"):
        np.testing.assert_allclose(found[name], true[name], rtol=0, atol=speed)


@pytest.mark.parametrize(
    "engine",
    ["exudyn[formulation=carrier]", "exudyn[formulation=rolling_disc]", "mujoco[formulation=facets]", "reduced"],
)
def test_who_cannot_slip_says_so(engine: str) -> None:
    """A formulation whose ball cannot slip refuses a start that does."""
    with pytest.raises(Refused, match="a start that slips"):
        simulate(load_scene("slide_to_roll"), engine, until=0.1, every=0.05)
