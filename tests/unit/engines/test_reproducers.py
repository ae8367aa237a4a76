"""Programs that show what an engine does without proofroll move the ball as its adapter does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from proofroll.engine import Reproduces
from proofroll.errors import Refused
from proofroll.registry import load_engine, resolve_settings
from proofroll.scene_file import load_scene

CYLINDER, PLANE = "sphere_in_cylinder", "inclined_plane"
PROGRAMS = [
    ("mujoco", "free", "default"),
    ("mujoco", "free", "matched"),
    ("mujoco", "chart", "matched"),
    ("exudyn", "generic", "matched"),
    ("exudyn", "carrier", "default"),
    ("exudyn", "rolling_disc", "matched"),
    ("exudyn", "contact", "matched"),
    ("pinocchio", "free_flyer", "default"),
    ("pinocchio", "contact", "default"),
    ("pinocchio", "contact", "matched"),
]


def kind_of(engine: str) -> Any:
    """The engine's class, if it is installed."""
    pytest.importorskip(engine)
    return load_engine(engine)


def program(engine: str, settings: Any, scene: Any) -> dict[str, Any]:
    """What the program defines."""
    found: dict[str, Any] = {}
    exec(compile(kind_of(engine).reproducer(scene, settings), "program", "exec"), found)
    return found


@pytest.mark.parametrize("scene", [CYLINDER, PLANE])
@pytest.mark.parametrize(("engine", "formulation", "preset"), PROGRAMS)
def test_the_same_motion(scene: str, engine: str, formulation: str, preset: str) -> None:
    """Centre, velocity and angular velocity are those of the adapter, and the wall is the scene's."""
    kind = kind_of(engine)
    assert isinstance(kind, Reproduces)
    settings = resolve_settings(kind, {"formulation": formulation, "preset": preset})
    loaded = load_scene(scene)
    made = program(engine, settings, loaded)
    times = [10 * step * settings.dt for step in range(6)]
    states = list(made["run"](times))
    adapter, surface = kind.build(loaded, settings), loaded.rolling.surface
    for t, state in zip(times, states, strict=True):
        adapter.advance(t)
        sample = adapter.sample()
        for name, value in zip(("p_WB", "v_WB", "w_WB"), state, strict=True):
            expected = getattr(sample, name)
            np.testing.assert_allclose(value, expected, rtol=1e-8, atol=1e-8 * float(np.linalg.norm(expected)) + 1e-12)
        np.testing.assert_allclose(made["frame"](sample.p_WB), surface.frame(surface.locate(sample.p_WB)).T, atol=1e-12)
        assert made["gap"](sample.p_WB) == pytest.approx(float(surface.gap(sample.p_WB)), abs=1e-14)


@pytest.mark.parametrize(
    ("engine", "options", "parameters", "words"),
    [
        ("mujoco", {"formulation": "free", "preset": "tuned"}, {}, "no documented use"),
        ("mujoco", {"formulation": "chart"}, {"rolling_resistance": 5e-4}, "no rolling resistance"),
        ("exudyn", {"formulation": "generic"}, {"mu_static": 0.3}, "no bounded friction"),
        ("exudyn", {"formulation": "contact"}, {"rolling_resistance": 5e-4}, "no rolling resistance"),
        ("pinocchio", {"formulation": "free_flyer"}, {}, "scipy's"),
        ("pinocchio", {"formulation": "composite", "preset": "default"}, {}, "no program"),
    ],
)
def test_what_has_no_program(engine: str, options: dict[str, str], parameters: dict[str, float], words: str) -> None:
    """Where there is no program, a sentence says why."""
    kind = kind_of(engine)
    with pytest.raises(Refused, match=words):
        kind.reproducer(load_scene(CYLINDER, **parameters), resolve_settings(kind, options))
