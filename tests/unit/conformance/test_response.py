"""Allowance of a conformance run for what one step beside an event does."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.conformance import response
from proofroll.conformance.subject import Subject, UnlikeSceneError, contrasts
from proofroll.core.events import Event, with_events
from proofroll.core.plugins import load_engine
from proofroll.files.scene_file import load_scene

STEP, APART = 1e-3, 2e-8


def jumping(times: tuple[float, ...], names: tuple[str, ...]) -> xr.Dataset:
    """A ball whose velocities jump by 1 and, moments later, by 2."""
    t = np.array(times)
    values = 1.0 * (t > 0.05) + 2.0 * (t > 0.05 + APART)
    both = {name: (("time", "axis"), values[:, None] * [1.0, 0.0, 0.0]) for name in names}
    found = xr.Dataset({**both, "p_WB": (("time", "axis"), np.zeros((len(t), 3)))}, {"time": t})
    return with_events(found, [Event("impact", time, time, time) for time in (0.05, 0.05 + APART)])


@pytest.mark.parametrize(
    ("names", "allowed"), [(("v_WB", "w_WB"), {"p_WB", "v_WB", "w_WB"}), (("v_WB",), {"p_WB", "v_WB"}), ((), set())]
)
def test_jumps_that_follow_at_once_count_together(
    monkeypatch: pytest.MonkeyPatch, names: tuple[str, ...], allowed: set[str]
) -> None:
    """Two jumps within a moment allow a step's way at their sum; elements without velocities are allowed nothing."""
    scene = load_scene("bouncing_ball")
    monkeypatch.setattr(response, "_trajectory", lambda _, times: jumping(times, names))
    found = response._beside_events(scene, STEP, jumping((0.0, 0.1), names))
    assert set(found) == allowed
    if names:
        assert found["p_WB"] == pytest.approx(3 * STEP)


@pytest.mark.parametrize(
    ("law", "formulation"),
    [("limit_of_efforts", "joints"), ("held_targets", "joints"), ("restitution", "geoms")],
)
def test_a_law_that_an_engine_drops_is_found(law: str, formulation: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An honest engine is nearer to the truth with a law; one that runs the scene without it fails, however soft."""
    pytest.importorskip("mujoco")
    engine, (scene, without) = load_engine("mujoco"), contrasts()[law]
    settings = engine.presets[formulation]["matched"]
    response.law_acts(Subject(engine, settings, scene), without)
    moved = response._moved
    monkeypatch.setattr(
        response, "_moved", lambda _, times, true: moved(Subject(engine, settings, without), times, true)
    )
    with pytest.raises(UnlikeSceneError, match="the engine does not follow it"):
        response.law_acts(Subject(engine, settings, scene), without)
