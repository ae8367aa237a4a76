"""The projection method in compiled Taylor series gives what it gives in numpy, and says where it cannot."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from placed_balls import placed, scene_with
from true_runs import true_run

from proofroll.core import heyoka_library as library
from proofroll.core.errors import Missing
from proofroll.core.gravity import Gravity
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build, simulate

Projection = load_engine("projection")

needs_heyoka = pytest.mark.skipif(not library.available(), reason="heyoka is not installed")

GENERAL = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0}
RESISTING = load_scene("sphere_in_cylinder", **GENERAL, rolling_resistance=5e-4)
SCENES: dict[str, Scene] = {
    "cylinder": load_scene("sphere_in_cylinder", **GENERAL),
    "cylinder-resisting": RESISTING,
    # the singularity of the angles stays about the world's vertical
    "tilted": scene_with(
        RESISTING,
        surface=dataclasses.replace(placed(RESISTING).surface, tilt=0.3),
        gravity=Gravity(9.81, (-math.sin(0.3), 0.0, -math.cos(0.3))),
    ),
}


def state(scene: Scene, formulation: str, t: float, **settings: Any) -> tuple[Any, Any]:
    """State and sample of the engine at time t [s]."""
    engine = build(scene, "projection", formulation=formulation, **settings)
    engine.advance(t)
    return engine._motion.x, engine.sample()


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("cylinder-resisting-euler", "tilted-euler")
@needs_heyoka
@pytest.mark.parametrize("formulation", ["euler", "rotating_frame"])
@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_same_answers_as_numpy(scene: Scene, formulation: str) -> None:
    """States and multipliers agree with those that numpy and DOP853 give, angles included, to round-off."""
    x, sample = state(scene, formulation, 0.2, preset="tuned")
    expected, other = state(scene, formulation, 0.2, preset="matched")
    difference = x - expected
    angles = build(scene, "projection", formulation=formulation)._angles
    difference[angles] = np.remainder(difference[angles] + np.pi, 2 * np.pi) - np.pi  # whole turns say nothing
    assert np.max(np.abs(difference) / np.maximum(1.0, np.abs(expected))) < 2e-11
    assert sample.contact_force is not None
    assert np.max(np.abs(sample.contact_force - other.contact_force)) < 1e-10
    assert np.max(np.abs(sample.p_WB - other.p_WB)) < 1e-12
    assert (sample.q_WB is None) == (formulation == "rotating_frame")


@needs_heyoka
@pytest.mark.parametrize("formulation", ["euler", "rotating_frame"])
def test_multipliers_of_any_state(formulation: str) -> None:
    """λ and the accelerations are those of the numeric system also in a state that violates the constraints."""
    taylor, numeric = (build(RESISTING, "projection", formulation=formulation, preset=p) for p in ("tuned", "matched"))
    x = numeric._motion.x + np.linspace(0.1, 0.4, len(numeric._motion.x))
    taylor._motion.x = x
    response = numeric._ball.response(numeric._ball.kinematics(x))
    assert taylor._motion.rates == pytest.approx(numeric._ball.rates(x), rel=1e-12, abs=1e-11)
    assert taylor._motion.force == pytest.approx(numeric._ball.contact_force(response), rel=1e-12)


@pytest.mark.drill
@pytest.mark.one_in(2)
@needs_heyoka
@pytest.mark.parametrize(("formulation", "drift"), [("euler", 1e-11), ("rotating_frame", 1e-13)])
def test_nothing_is_left_to_eliminate(formulation: str, drift: float) -> None:
    """After 5 s, 90 turns of the ball, the contact point slips at round-off though nothing removes the violation."""
    scene = load_scene("sphere_in_cylinder", rolling_resistance=5e-4)
    run = simulate(scene, "projection", until=5.0, every=0.5, formulation=formulation, preset="tuned")
    assert run.attrs["status"] == "done"
    assert float(np.max(np.hypot(run["slip2"], run["slip3"]))) < drift  # of 4 m/s


@pytest.mark.drill
@pytest.mark.one_in(2)
@needs_heyoka
@pytest.mark.parametrize("preset", ["matched", "tuned"])
def test_the_singularity(preset: str) -> None:
    """A ball whose spin axis passes the vertical is carried through the singularity only in other axes."""
    scene = load_scene("sphere_in_cylinder", speed=4.0, axial_speed=4.0)
    stopped = simulate(scene, f"projection[preset={preset},singularity=stop]", until=0.2, every=0.05)
    assert stopped.attrs["status"] == "diverged"
    assert "near the Euler-angle singularity" in stopped.attrs["message"]
    run = simulate(scene, f"projection[preset={preset}]", until=0.2, every=0.05)
    assert "were chosen anew" in run.attrs["message"]
    true = true_run(scene, 0.2, 0.05)
    assert float(np.max(np.abs(run["p_WB"] - true["p_WB"]))) < 1e-11


@needs_heyoka
def test_a_sample_before_the_singularity_is_still_given() -> None:
    """What lies beyond the asked time is no reason to fail, even where a step of the series ends there."""
    engine = build(RESISTING, "projection[formulation=euler,preset=tuned]")
    engine.advance(1e-5)
    series = engine._motion._integrator
    assert series.time > 1e-5
    series.state[3] = 0.0  # θ at the end of the step
    engine.advance(2e-5)
    assert engine._motion.t == 2e-5


def test_elimination_is_on_by_default() -> None:
    """Every integrator eliminates unless told otherwise."""
    assert resolve_settings(Projection, {}).eliminates
    assert not resolve_settings(Projection, {"elimination": False}).eliminates
    assert resolve_settings(Projection, {"integrator": "taylor"}).eliminates


def test_what_taylor_cannot_do_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A missing heyoka is one line that says what to do."""
    monkeypatch.setattr(library, "available", lambda: False)
    with pytest.raises(Missing, match=r"needs heyoka.*proofroll\[fast\]"):
        build(RESISTING, "projection[integrator=taylor]")
