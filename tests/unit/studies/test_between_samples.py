"""What engines say between the samples of a run, where nobody but the judge looks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.plugins import load_engine
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.studies.comparison import default_comparison as first_look
from proofroll.studies.judging.judge import Judged, judge

EVERY, UNTIL = 0.02, 0.4
Change = Callable[[Any], Any]


def lying(engine: str, change: Change, *, everywhere: bool = False) -> type[Any]:
    """The engine, with samples that are right at multiples of the interval alone, or only at the start."""
    kind: Any = load_engine(engine)

    class Liar(kind):  # type: ignore[misc]  # a class that is loaded by its name
        @classmethod
        def build(cls, scene: Any, settings: Any) -> Any:
            return _Lies(kind.build(scene, settings), change, everywhere)

    return Liar


class _Lies:
    def __init__(self, honest: Any, change: Change, everywhere: bool) -> None:
        self._honest, self._change, self._everywhere, self._t = honest, change, everywhere, 0.0

    def advance(self, t: float) -> None:
        self._t = t
        self._honest.advance(t)

    def built(self) -> Any:
        return self._honest.built()

    def sample(self) -> Any:
        right = self._honest.sample()
        hidden = abs(self._t / EVERY - round(self._t / EVERY)) > 1e-6
        return self._change(right) if hidden or (self._everywhere and self._t > 0.01) else right


def judged(scene: str, engine: Any, **settings: Any) -> Judged:
    """A run of the engine, judged as a person would."""
    return judge(simulate(scene, engine, until=UNTIL, every=EVERY, **settings), scene)


HONEST = {
    "double_pendulum": ("projection", {"formulation": "dependent"}),
    "sphere_in_cylinder": ("projection", {"formulation": "euler"}),
}
BETWEEN: list[tuple[str, str, Change]] = [
    ("double_pendulum", "positions", lambda s: replace(s, p_WB=np.asarray(s.p_WB) + 0.1)),
    ("double_pendulum", "forces", lambda s: replace(s, joint_force=100 * np.asarray(s.joint_force))),
    ("sphere_in_cylinder", "z", lambda s: replace(s, p_WB=s.p_WB + np.array([0, 0, 0.1]))),
    ("sphere_in_cylinder", "N", lambda s: replace(s, contact_force=100 * np.asarray(s.contact_force))),
]


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("scene", HONEST)
def test_an_honest_run_agrees(scene: str) -> None:
    """An honest engine is right between its samples, too."""
    engine, settings = HONEST[scene]
    found = judged(scene, engine, **settings)
    assert found.agrees, found


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("scene", "name", "change"), BETWEEN, ids=[f"{scene}-{name}" for scene, name, _ in BETWEEN])
def test_what_is_wrong_between_the_samples_differs(scene: str, name: str, change: Change) -> None:
    """A place or a force that is right at every sample, and wrong between them, is no agreement."""
    engine, settings = HONEST[scene]
    found = judged(scene, lying(engine, change), **settings)
    wrong = [item.judgement for item in found.compared if not item.agrees]
    assert name in [item.observable for item in wrong]
    assert all("so the error is between them" in item.reason for item in wrong)


STATES: dict[str, Change] = {
    "p_WB": lambda s: replace(s, p_WB=np.asarray(s.p_WB) + np.array([[7.0], [0.0]])),  # of what holds no tracked point
    "v_WB": lambda s: replace(s, v_WB=np.asarray(s.v_WB) + 7),
    "w_WB": lambda s: replace(s, w_WB=np.asarray(s.w_WB) + 7),
}


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", STATES)
def test_states_of_mechanisms_are_judged(name: str) -> None:
    """7 m, 7 m/s or 7 rad/s too much in every sample but the first is no agreement, at right tracked points or not."""
    engine, settings = HONEST["double_pendulum"]
    liar = lying(engine, STATES[name], everywhere=True)
    run = simulate("double_pendulum", liar, until=UNTIL, every=EVERY, **settings)
    bounds = first_look.bounds(load_scene("double_pendulum"), 0.01)
    assert {"positions", "p_WB", "v_WB", "w_WB"} <= bounds.keys()
    found = judge(run, "double_pendulum", dict.fromkeys(bounds, "1 %"))
    assert [item.judgement.observable for item in found.compared if not item.agrees] == [name]


@pytest.mark.drill
def test_a_first_look_judges_the_orientation_that_a_scene_asks_for() -> None:
    """Quaternions of a ball that are frozen between samples agree nowhere, and are judged where they were asked for."""
    scene = load_scene("sphere_in_cylinder", asks=("orientation",))
    bounds = first_look.bounds(scene, EVERY)
    assert bounds.keys() - first_look.bounds(load_scene("sphere_in_cylinder"), EVERY).keys() == {"attitude"}
    frozen = lying("projection", lambda right: replace(right, q_WB=np.array([1.0, 0, 0, 0])))
    found = judge(simulate(scene, frozen, until=UNTIL, every=EVERY), scene, {"attitude": "1 %"})
    assert not found.agrees
    assert found.compared[0].judgement.reason.endswith("between them")


COMPARISONS = sorted((Path(__file__).parents[3] / "comparisons").rglob("*.toml"))
JUDGES_PLACES = [path for path in COMPARISONS if '\npositions = "' in path.read_text(encoding="utf-8")]


@pytest.mark.one_in(4)
@pytest.mark.parametrize("path", JUDGES_PLACES, ids=lambda path: path.stem)
def test_every_claim_about_places_is_one_about_the_state(path: Path) -> None:
    """Whoever says in a comparison of this project how far places may be off says it of velocities and spins too.

    Tracked points are not all places: of the other bodies it says so by ``p_WB``, or by how far joints may open.
    """
    comparison = load_comparison(str(path))
    tracked = any(element.mechanism.points for element in load_scene(comparison.scene).elements)  # type: ignore[attr-defined]  # mechanisms
    for band in comparison.bands.values():
        assert "positions" not in band.bounds or {"v_WB", "w_WB"} <= band.bounds.keys()
        assert "positions" not in band.bounds or not tracked or {"p_WB", "drift"} & band.bounds.keys()


def test_the_times_are_on_the_grid_of_the_steps() -> None:
    """A run with a fixed step is asked at ends of its steps alone, and no run at more than eight times besides."""
    run = simulate(
        "double_pendulum", "projection[formulation=dependent,integrator=rk4,dt=0.005]", until=UNTIL, every=EVERY
    )
    between = run["between"].to_numpy()
    assert 0 < len(between) <= 8
    assert between / 0.005 == pytest.approx(np.round(between / 0.005), abs=1e-6)
