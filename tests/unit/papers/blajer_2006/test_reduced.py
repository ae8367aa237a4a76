"""The least model as an engine: accuracy, refusals, settings, and what its Taylor series do between samples."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.conformance.subject import scenes
from proofroll.core import heyoka_library as library
from proofroll.core.engine_abilities import Level, TellsLevels
from proofroll.core.errors import Diverged, Missing, Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.reduced import Reduced
from proofroll.running.simulation import build

TAYLOR = "reduced[preset=tuned]"
needs_heyoka = pytest.mark.skipif(not library.available(), reason="heyoka is not installed")


SCENES = {name: scene for name, scene in scenes().items() if name in {"cylinder", "cylinder-resisting"}} | {
    "backwards": load_scene("sphere_in_cylinder", speed=-4.0, rolling_resistance=5e-4),
}


@pytest.mark.parametrize("engine", ["reduced", pytest.param(TAYLOR, marks=needs_heyoka)])
@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_equations_against_the_truth(engine: str, scene: Scene) -> None:
    """Path and forces agree to round-off with the truth of the ball as a body, which shares nothing with the engine."""
    times = np.linspace(0, 0.5, 6)
    true = truth(scene, times)
    built = build(scene, engine)
    for index, t in enumerate(times):
        built.advance(float(t))
        sample = built.sample()
        assert np.max(np.abs(sample.p_WB - true["p_WB"].to_numpy()[index])) < 1e-12
        assert np.max(np.abs(sample.w_WB - true["w_WB"].to_numpy()[index])) < 1e-9
        assert sample.contact_force is not None
        size = np.linalg.norm([true[name].to_numpy()[index] for name in ("N", "F2", "F3")])
        assert np.linalg.norm(sample.contact_force) == pytest.approx(size, abs=1e-10)


def test_closed_form_against_the_truth() -> None:
    """The closed form agrees with the truth of the ball as a body."""
    true = truth(SCENES["cylinder"], np.array([0.0, 0.5]))
    engine = build(SCENES["cylinder"], "reduced[formulation=closed_form]")
    engine.advance(0.5)
    assert np.max(np.abs(engine.sample().p_WB - true["p_WB"].to_numpy()[-1])) < 1e-12


@needs_heyoka
def test_samples_cost_no_steps() -> None:
    """A run with a thousand samples takes the very steps of a run with one, and ends on the same bits."""
    often, once = (build(SCENES["cylinder-resisting"], TAYLOR) for _ in range(2))
    for t in np.linspace(0, 1, 1001)[1:]:
        often.advance(float(t))
    once.advance(1.0)
    assert often._series._integrator.time == once._series._integrator.time > 1.0
    assert often.sample().p_WB.tobytes() == once.sample().p_WB.tobytes()


def test_closed_form_is_refused_where_there_is_none() -> None:
    """Where there is no closed form the refusal says why."""
    with pytest.raises(Refused, match="no closed form with rolling resistance"):
        build(SCENES["cylinder-resisting"], "reduced[formulation=closed_form]")


def test_taylor_without_heyoka_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without heyoka the refusal names the extra, and the version tells it from an installation that has it."""
    monkeypatch.setattr(library, "available", lambda: False)
    with pytest.raises(Missing, match=r"^integrator=taylor needs heyoka.*proofroll\[fast\].*$"):
        build(SCENES["cylinder"], TAYLOR)
    assert "heyoka" not in Reduced.version()
    build(SCENES["cylinder"], "reduced").advance(0.1)


def test_levels_and_terms() -> None:
    """Each formulation has its rung, and resistance is built only where the scene has it."""
    assert isinstance(Reduced, TellsLevels)
    assert {Reduced.levels[name] for name in Reduced.presets} == {Level.CLOSED_FORM, Level.REDUCED}
    assert build(SCENES["cylinder"], "reduced").built().terms == frozenset()
    terms = build(SCENES["cylinder-resisting"], "reduced").built().terms
    assert terms == frozenset({MechanismCapability.TURNING_FRICTION})


@needs_heyoka
def test_no_resistance_no_term() -> None:
    """Without resistance the compiled equations have no parameter for it, with resistance they do."""
    counts = {
        name: len(build(SCENES[name], TAYLOR)._series._integrator.pars) for name in ("cylinder", "cylinder-resisting")
    }
    assert counts["cylinder"] < counts["cylinder-resisting"]


def test_a_loose_tolerance_is_looser_but_not_lost() -> None:
    """At a tolerance of 1e-6 the path is worse than at the tightest, and still good to a micrometre."""
    scene = SCENES["cylinder-resisting"]
    true = truth(scene, np.array([0.0, 1.0]))["p_WB"].to_numpy()[-1]
    found = {}
    for rtol in (1e-6, 1e-12):
        engine = build(scene, "reduced", rtol=rtol)
        engine.advance(1.0)
        found[rtol] = float(np.max(np.abs(engine.sample().p_WB - true)))
    assert found[1e-12] < found[1e-6] < 1e-6


@needs_heyoka
def test_not_finite_is_noticed() -> None:
    """A state that overflows is reported with its time instead of being sampled."""
    engine = build(SCENES["cylinder"], TAYLOR)
    engine._series._integrator.state[2:] = 1e200
    with pytest.raises(Diverged, match="not finite"):
        engine.advance(1.0)
