"""Shrinking: what remains shows the same surprise, what does not is told apart, and other failures are kept."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from proofroll.core.errors import ProofrollError
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll_fuzz import shrink as shrinking
from proofroll_fuzz.drawing import drawn_scene
from proofroll_fuzz.evaluation import EvaluatedScene
from proofroll_fuzz.mechanisms.families import FAMILIES
from proofroll_fuzz.shrink import Shrinker, SmallestScene
from proofroll_fuzz.surprises import Surprise, SurpriseKind

_STOPS = Surprise(SurpriseKind("tiny chart", "stops", "solver", "start"), 5.0, "the solver gave up")
_CRASHES = Surprise(SurpriseKind("tiny chart", "crashes"), 9.0, "its process ended")


def _fails(tables: Mapping[str, Any]) -> tuple[Surprise, ...]:
    """An engine that stops where a joint with damping starts forward, and crashes with a certain gravity."""
    if tables["gravity"]["magnitude"] == 10.0:
        return (_CRASHES,)
    return (_STOPS,) * any(
        row.get("damping", 0) and row.get("v0", 0) > 0 for row in tables["joints"] if "damping" in row
    )


def _shrunk(tmp_path: Path, budget: float, other: Any = lambda *_: None) -> tuple[SmallestScene, dict[str, Any]]:
    families = {"tree": FAMILIES["tree"]}
    tables = next(
        tables for tables in (drawn_scene(families, seed).tables for seed in range(1000)) if _fails(tables) == (_STOPS,)
        and len(tables["bodies"]) > 2
    )  # fmt: skip
    runner = Runner(Store(tmp_path / "cases"))
    shrinker = Shrinker(_STOPS, "tiny", FAMILIES["tree"], tmp_path, runner, limit=20, budget=budget, other=other)
    smallest = shrinker.shrink(tables, tmp_path / "out")
    return smallest, tomllib.loads((Path(smallest.folder) / "scene.toml").read_text())


@pytest.fixture
def _evaluated(monkeypatch: pytest.MonkeyPatch) -> None:
    def evaluate(folder: Path, *_: object, **__: object) -> EvaluatedScene:
        try:
            load_scene(str(folder))
        except ProofrollError as error:
            return EvaluatedScene(invalid=str(error))
        tables = tomllib.loads((folder / "scene.toml").read_text())
        return EvaluatedScene(truth=Status.DONE, surprises=_fails(tables))

    monkeypatch.setattr(shrinking, "evaluate_scene", evaluate)
    monkeypatch.setattr(shrinking, "outcome_of", lambda *_: None)


@pytest.mark.drill
@pytest.mark.usefixtures("_evaluated")
def test_a_scene_is_shrunk_to_what_the_surprise_needs(tmp_path: Path) -> None:
    """One body, one joint with damping and a speed are left, with numbers of two digits at most."""
    smallest, tables = _shrunk(tmp_path, 60.0)
    assert [len(tables[name]) for name in ("bodies", "joints")] == [1, 1]
    assert set(tables) == {"title", "source", "duration", "dt", "every", "gravity", "bodies", "joints"}
    assert smallest.tables == 3
    assert smallest.digits <= 2
    assert _fails(tables) == (_STOPS,)
    assert smallest.kept < smallest.tries


@pytest.mark.drill
@pytest.mark.usefixtures("_evaluated")
def test_the_nearest_scene_that_passes_is_told_and_written(tmp_path: Path) -> None:
    """The other direction of the speed passes, in one clause, and is a scene file of its own."""
    smallest, tables = _shrunk(tmp_path, 60.0)
    joint = tables["joints"][0]
    assert smallest.nearest == f"passes with joints.{joint['name']}.v0 = {-joint['v0']:g} instead of {joint['v0']:g}"
    nearest = tomllib.loads((Path(smallest.folder) / "nearest" / "scene.toml").read_text())
    assert _fails(nearest) == ()
    assert nearest["joints"][0]["v0"] == -joint["v0"]


@pytest.mark.drill
@pytest.mark.usefixtures("_evaluated")
def test_a_try_with_another_failure_is_passed_on(tmp_path: Path) -> None:
    """A rejected try that fails in another way is a find of its own, not a smaller scene."""
    further: list[tuple[Mapping[str, Any], Surprise]] = []
    _, tables = _shrunk(tmp_path, 60.0, lambda *found: further.append(found))
    assert {surprise for _, surprise in further} == {_CRASHES}
    assert all(_fails(scene) == (_CRASHES,) for scene, _ in further)
    assert _fails(tables) == (_STOPS,)


@pytest.mark.usefixtures("_evaluated")
def test_without_time_the_scene_stays(tmp_path: Path) -> None:
    """A budget of nothing leaves the scene as it is, which is kept as the smallest."""
    smallest, tables = _shrunk(tmp_path, 0.0)
    assert smallest.kept == 0
    assert smallest.nearest == ""
    assert _fails(tables) == (_STOPS,)


def test_an_infinite_friction_has_no_digits() -> None:
    """Digits of a smallest scene are those of its numbers, not the letters of an infinite one."""
    assert shrinking._most_digits({"pairs": [{"name": "touch", "friction": float("inf"), "restitution": 0.25}]}) == 2
