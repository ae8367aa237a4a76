"""Hunts: planted faults are found, sound engines are not accused, and what was found is kept."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from planted import FAULTS

from proofroll.core.errors import InputError
from proofroll.running.case import Status
from proofroll_fuzz import hunt as hunting
from proofroll_fuzz.evaluation import EvaluatedScene
from proofroll_fuzz.hunt import hunt
from proofroll_fuzz.surprises import Surprise, SurpriseKind

Install = Callable[[Mapping[str, str]], None]
_HANGS = Surprise(SurpriseKind("tiny chart", "hangs"), 8.0, "no answer in 20 s")
_OFF = Surprise(SurpriseKind("tiny chart", "wrong limit", "force", "start"), 2.0, "force.pin is off by 1 N")
_EVALUATED = [
    EvaluatedScene(truth=Status.DONE, seconds=10),
    EvaluatedScene(truth=Status.DONE, surprises=(_OFF,), seconds=10),
    EvaluatedScene(fits=False),
    EvaluatedScene(invalid="joints.a.q0 = 1: no", seconds=1),
    EvaluatedScene(truth=Status.REFUSED, seconds=10),
    EvaluatedScene(truth=Status.DONE, surprises=(_HANGS, _OFF), seconds=29),
]


@pytest.fixture
def evaluated(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Scenes of a hunt for the truth, whose results are these in turn; an exception is raised."""
    scenes: list[Any] = [*_EVALUATED]

    def evaluate(*_: object) -> EvaluatedScene:
        scene = scenes.pop(0)
        if isinstance(scene, BaseException):
            raise scene
        return scene

    monkeypatch.setattr(hunting, "evaluate_scene", evaluate)
    return scenes


@pytest.mark.usefixtures("evaluated")
def test_a_hunt_counts_kinds_and_keeps_their_scenes(tmp_path: Path) -> None:
    """Each kind has its number of scenes and its first seed; only scenes that show a kind first are kept."""
    result = hunt("truth", tmp_path / "out", shrink=0, minutes=1, seed=40)
    assert (result.drawn, result.run, result.invalid, result.unfit, result.without_truth) == (6, 4, (43,), 1, 1)
    assert [(item.kind, item.count, item.seed, item.new) for item in result.kinds] == [
        ("tiny chart; hangs", 1, 45, True),
        ("tiny chart; wrong limit; force; start", 2, 41, True),
    ]
    assert sorted(path.parent.name for path in tmp_path.glob("out/*/scene.toml")) == ["41", "43", "45"]


@pytest.mark.usefixtures("evaluated")
def test_a_folder_that_was_there_is_left_alone(tmp_path: Path) -> None:
    """A hunt deletes nothing in the folder that it writes to, where a person's folders may have numbers for names."""
    (tmp_path / "40").mkdir()
    (tmp_path / "40" / "notes.txt").write_text("mine")
    hunt("truth", tmp_path, shrink=0, minutes=1, seed=40)
    assert (tmp_path / "40" / "notes.txt").read_text() == "mine"


def test_a_kind_is_new_once(evaluated: list[Any], tmp_path: Path) -> None:
    """A later hunt in the same folder knows the kinds of the earlier one, and ranks new ones before them."""
    hunt("truth", tmp_path, shrink=0, minutes=0.5)
    evaluated += [EvaluatedScene(truth=Status.DONE, surprises=(_OFF, _HANGS), seconds=60)]
    result = hunt("truth", tmp_path, shrink=0, minutes=1, seed=5)
    assert [(item.kind.split("; ")[1], item.new) for item in result.kinds] == [
        ("hangs", True),
        ("wrong limit", False),
    ]


def test_the_kind_of_a_finding_is_known_and_last(evaluated: list[Any], tmp_path: Path) -> None:
    """A kind that a finding about an engine names is not new, has the finding's name, and stands last."""
    kind = SurpriseKind("mujoco geoms", "wrong limit", "motion", "after impact")
    evaluated.insert(0, EvaluatedScene(truth=Status.DONE, surprises=(Surprise(kind, 7.0, "it rebounds"),), seconds=1))
    result = hunt("truth", tmp_path, shrink=0, minutes=1)
    assert [(item.new, item.finding) for item in result.kinds] == [
        (True, ""),
        (True, ""),
        (False, "mujoco_critically_damped_rebound"),
    ]


def test_an_interrupted_hunt_keeps_what_it_found(evaluated: list[Any], tmp_path: Path) -> None:
    """Ctrl-C ends a hunt with the kinds so far, which the next hunt knows."""
    evaluated[2] = KeyboardInterrupt()
    result = hunt("truth", tmp_path, shrink=0, minutes=1)
    assert result.interrupted
    assert [item.seed for item in result.kinds] == [1]
    assert list(json.loads((tmp_path / "kinds.json").read_text())) == ["tiny chart; wrong limit; force; start"]


@pytest.mark.parametrize(
    ("engine", "arguments", "field"),
    [
        ("truth", {"minutes": 0.0}, "--minutes"),
        ("truth", {"minutes": float("nan")}, "--minutes"),
        ("truth", {"seed": -1}, "--seed"),
        ("truth", {"families": ("chairs",)}, "--family"),
        ("mujocco", {}, "engine"),
    ],
)
def test_a_mistake_is_named(tmp_path: Path, engine: str, arguments: dict[str, Any], field: str) -> None:
    """An argument without sense is refused before any scene is drawn."""
    with pytest.raises(InputError, match=f"^{field}"):
        hunt(engine, tmp_path, **{"minutes": 1.0, **arguments})


def test_broken_memory_is_named(tmp_path: Path) -> None:
    """A broken file of known kinds is named with its remedy."""
    (tmp_path / "kinds.json").write_text("[1]")
    with pytest.raises(InputError, match=r"kinds\.json.*remove it"):
        hunt("truth", tmp_path, shrink=0, minutes=1)


@pytest.mark.usefixtures("evaluated")
def test_the_exit_code_tells_new_kinds(tmp_path: Path, command_line: Callable[..., tuple[int, str, str]]) -> None:
    """The command exits with 1 for a new kind, then with 0; its JSON has all kinds."""
    words = ["fuzz", "truth", "--out", str(tmp_path / "out"), "--minutes"]
    code, out, _ = command_line(*words, "0.3", "--json")
    shown = json.loads(out)
    assert code == 1
    assert [item["kind"] for item in shown["kinds"]] == ["tiny chart; wrong limit; force; start"]
    assert shown["kinds"][0]["largest"]["message"] == _OFF.message
    code, out, _ = command_line(*words, "0.01")
    assert code == 0
    assert "1 scenes were refused by the reader: seeds 1" in out or "No surprise" in out


@pytest.mark.nightly_of("3", "7")
@pytest.mark.nightly
@pytest.mark.parametrize("seed", [2, 3, 7])
def test_a_sound_engine_is_not_accused(seed: int, install_engines: Install, tmp_path: Path) -> None:
    """The example engine has no surprise in random trees."""
    install_engines({"sound": "planted:sound"})
    result = hunt("sound", tmp_path, minutes=1e-3, seed=seed, families=("tree",), jobs=1)
    assert (result.run, result.without_truth) == (1, 0)
    assert [item.kind for item in result.kinds if item.first.kind.formulation != "truth"] == []


# Planted fault -> families and first seed of a hunt of some processor-seconds that finds it.
_PLANTED = {
    **{name: (("tree",), 0) for name in FAULTS if name != "sound"},
    "bristle": (("tree",), 96),
    "late": (("tree",), 0),
    "rebound": (("contact",), 0),
}


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("fault", _PLANTED)
def test_planted_faults_are_found(fault: str, install_engines: Install, tmp_path: Path) -> None:
    """Each of twelve faults (signs, frames, rows, a clock, a start, friction) shows in seconds of random scenes."""
    install_engines({fault: f"planted:{fault}"})
    families, seed = _PLANTED[fault]
    found: list[str] = []

    class Found(Exception):  # noqa: N818 -- no error
        """Ends a hunt."""

    def progress(result: hunting.Hunt) -> None:
        found[:] = [item.kind for item in result.kinds if item.first.kind.formulation.startswith(fault)]
        if found:
            raise Found

    with contextlib.suppress(Found):
        hunt(fault, tmp_path, minutes=1, seed=seed, families=families, shrink=0, jobs=1, progress=progress)
    assert found
