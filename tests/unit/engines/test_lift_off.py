"""Every engine in a lying cylinder: the ball leaves the wall where the truth's does, and no wall pulls."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from proofroll import load_scene
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.core.truth import truth
from proofroll.elements.ball_on_surface.element import scene_with
from proofroll.running.recording import record
from proofroll.running.simulation import build

TIMES = time_grid(0.4, 5e-3)
# Engine, how far its lift-off may be from the truth's [s], its path [m], and whether its ball flies on. A model that
# holds the ball is known between two samples; a soft contact lets go late (balls.md's 9e-3 s at a step of 1e-3 s).
ENGINES = [
    ("reduced", 1e-4, 1e-12, False),
    ("projection", 1e-4, 1e-12, False),
    ("projection[formulation=rotating_frame]", 1e-4, 1e-12, False),
    ("exudyn", 1e-4, 1e-6, False),
    ("exudyn[formulation=carrier]", 1e-4, 1e-5, False),
    ("exudyn[formulation=rolling_disc]", 1e-4, 1e-5, False),
    ("exudyn[formulation=contact]", 5e-4, 1e-4, False),
    ("pinocchio", 5e-3, 1e-12, False),
    ("pinocchio[preset=default]", 1e-3, 1e-6, False),
    ("pinocchio[formulation=free_flyer]", 5e-3, 1e-12, False),
    ("pinocchio[formulation=contact]", 5e-3, 1e-4, True),
    ("mujoco[formulation=chart]", 5e-3, 5e-4, True),
    ("mujoco[formulation=free]", 2e-2, 1e-2, True),
]


def need(engine: str) -> None:
    """Skips the test where the package of an engine that is not ours is not installed."""
    if not engine.startswith(("reduced", "projection")):
        pytest.importorskip(engine.partition("[")[0])


def lying(mu: float = math.inf) -> Scene:
    """The paper's cylinder on its side, the ball at 2.7 m/s from its bottom: too slow to pass the top."""
    scene = load_scene("sphere_in_cylinder", speed=2.7, mu_static=mu)
    return scene_with(scene, surface=replace(scene.elements[0].surface, tilt=math.pi / 2))


@functools.cache
def fallen() -> xr.Dataset:
    """The truth of it, once for all engines."""
    return truth(lying(), TIMES)


@pytest.mark.parametrize(("engine", "late", "apart", "flies"), ENGINES)
def test_lift_off(engine: str, late: float, apart: float, flies: bool) -> None:
    """With unbounded friction the lift-off is an event with a bracket; a model that cannot let go ends there."""
    need(engine)
    scene = lying()
    true = fallen()
    (event,) = events_of(true)
    recording = record(build(scene, engine), scene, TIMES)
    assert recording.failure is None
    found = recording.dataset
    (left,) = events_of(found)
    assert left.kind == "lift_off"
    assert left.time_low <= left.time <= left.time_high
    assert left.time == pytest.approx(event.time, abs=late)
    assert found.attrs["smallest_N"] >= -1e-9
    assert (recording.ended is None) == flies
    assert (found.sizes["time"] == len(TIMES)) == flies
    np.testing.assert_allclose(found.p_WB, true.p_WB[: found.sizes["time"]], atol=apart)


@pytest.mark.parametrize("engine", ["projection", "exudyn", "exudyn[formulation=contact]", "pinocchio"])
def test_with_a_bound_it_slips_first(engine: str) -> None:
    """With friction of any bound the ball slips and then leaves, when the truth's does."""
    need(engine)
    scene = lying(0.5)
    recording = record(build(scene, engine), scene, TIMES)
    assert recording.failure is None
    events = events_of(recording.dataset)
    assert [event.kind for event in events] == ["slip", "lift_off"]
    assert [event.time for event in events] == pytest.approx([0.230612909, 0.267707909], abs=1e-4)
