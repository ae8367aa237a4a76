"""Studies that are kept: believed while what they hang on is what it was, under names that do not collide."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import pytest
from invented import boundary_point, stability_study
from invented_answers import HELD, scene_answer

from proofroll.running.environments import STAMP, VARIABLE, Environment
from proofroll.running.timing import machine
from proofroll.studies import study_store
from proofroll.studies.answer.records import SceneAnswer
from proofroll.studies.stability.axes import QUICK, Axis, Effort
from proofroll.studies.stability.claims import file_for
from proofroll.studies.stability.map import stability_path
from proofroll.studies.stability.records import MappedValue, StabilityStudy
from proofroll.studies.study_store import keep_study, valid_study


@dataclasses.dataclass
class Study:
    """The least that can be kept."""

    points: list[int]
    measured: study_store.Measured


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A study that was kept just now."""
    path = tmp_path / "study.json"
    keep_study(Study([1], study_store.conditions_now()), path)
    return path


def changed(path: Path, **values: Any) -> Path:
    """The same file with something else in what it was measured with."""
    study, _ = valid_study(path, Study)
    assert study is not None
    keep_study(dataclasses.replace(study, measured=dataclasses.replace(study.measured, **values)), path)
    return path


def test_a_study_of_this_code_on_this_machine_holds(path: Path) -> None:
    """It comes back as it was put, and nothing speaks against it."""
    study, reasons = valid_study(path, Study)
    assert study is not None
    assert (study.points, reasons) == ([1], [])


def test_parameters_without_a_bound_come_back(tmp_path: Path) -> None:
    """Friction that nothing exceeds is no number of JSON, and yet a parameter that somebody may set."""
    unbounded = {"mu_static": math.inf}
    study = dataclasses.replace(scene_answer(HELD), parameters=unbounded, measured=study_store.conditions_now())
    keep_study(study, tmp_path / "study.json")
    assert valid_study(tmp_path / "study.json", SceneAnswer) == (study, [])


def test_an_axis_to_infinity_comes_back(tmp_path: Path) -> None:
    """So may a map be taken to friction that nothing exceeds: its axis, its points and its places are as they were."""
    unbounded = {"mu_static": math.inf}
    axes = [Axis("friction", "1", "how it grips", [0.3, math.inf])]
    points = [boundary_point(axis="friction", value=math.inf, parameters=unbounded)]
    places = [MappedValue("friction", math.inf, unbounded, None)]
    study = dataclasses.replace(stability_study(), axes=axes, points=points, places=places)
    keep_study(study, tmp_path / "study.json")
    assert valid_study(tmp_path / "study.json", StabilityStudy) == (study, [])


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"code": "another"}, "proofroll's own code has changed"),
        ({"versions": {}}, "numpy absent then"),
        ({"machine": {}}, "processor None then"),
    ],
)
def test_a_study_of_another_code_version_or_machine_does_not(path: Path, values: Any, words: str) -> None:
    """It is not given, and what has changed is said."""
    study, reasons = valid_study(changed(path, **values), Study)
    assert study is None
    assert any(reason.startswith(words) for reason in reasons), reasons


def test_a_study_that_was_tampered_with_does_not(path: Path) -> None:
    """One number that is not what was put there, and it is not given."""
    path.write_text(path.read_text().replace('"points": [1]', '"points": [2]'))
    assert valid_study(path, Study) == (None, ["the stored data differ from those that were written"])


def test_another_file_has_a_map_of_its_own(tmp_path: Path) -> None:
    """Other values of an axis, though of the same name, are another map."""
    asked = file_for("inclined_plane")
    axes = [dataclasses.replace(axis, values=axis.values[:2]) for axis in asked.axes]
    first = stability_path(tmp_path, asked.scene, asked.axes, (), Effort())
    assert stability_path(tmp_path, asked.scene, axes, (), Effort()) != first


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"measured": 3}'])
def test_a_file_that_is_no_study_is_as_none(tmp_path: Path, text: str) -> None:
    """Half a file, another file and none at all are alike: there is no study, and no reason to name."""
    (tmp_path / "study.json").write_text(text)
    assert valid_study(tmp_path / "study.json", Study) == (None, [])
    assert valid_study(tmp_path / "nothing.json", Study) == (None, [])


def test_a_part_of_a_map_never_takes_the_place_of_the_whole(tmp_path: Path) -> None:
    """Quick, restricted to engines or to axes: each has a file of its own, the same the next time."""
    asked = file_for("inclined_plane")
    efforts = (Effort(), QUICK)
    paths = [
        stability_path(tmp_path, asked.scene, axes, engines, effort)
        for axes in (asked.axes, asked.axes[:1])
        for engines in ((), ("mujoco",))
        for effort in efforts
    ]
    assert len(set(paths)) == len(paths)
    assert stability_path(tmp_path, asked.scene, list(asked.axes), (), QUICK) == paths[1]


def test_nothing_has_changed_since_now() -> None:
    """What was measured here with this code still holds."""
    assert study_store.changes(study_store.conditions_now()) == []


def test_engines_are_among_the_versions() -> None:
    """Every engine's package is told with its version, without importing it."""
    assert {"proofroll", "mujoco", "exudyn", "pin", "numpy", "scipy"} <= study_store.versions().keys()


@pytest.mark.drill
def test_an_environment_that_was_made_anew_is_a_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same label with other packages outdates a study; a further label, or one that is gone, does not."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))

    def make(label: str, *packages: str) -> None:
        (tmp_path / "aged" / label).mkdir(parents=True, exist_ok=True)
        Environment("aged", label, tmp_path / "aged" / label, "1.0", [], "3.11", list(packages)).stamp()

    make("1.0", "numpy==2.0")
    before = study_store.conditions_now()
    make("2.0", "numpy==2.0")
    assert study_store.changes(before) == []
    make("1.0", "numpy==2.1")
    (change,) = study_store.changes(before)
    assert change.startswith("aged@1.0 ")
    (tmp_path / "aged" / "1.0" / STAMP).unlink()
    assert study_store.changes(before) == []


def test_each_change_is_told() -> None:
    """Another machine, another version, a package that is gone and other code are each one short text."""
    other = study_store.changes(
        study_store.Measured(
            "then",
            machine() | {"processor": "an abacus"},
            {name: v for name, v in study_store.versions().items() if name != "mujoco"} | {"numpy": "1.0"},
            "0",
        )
    )
    assert len(other) == 4
    text = "; ".join(other)
    for words in ("processor an abacus then", "mujoco absent then", "numpy 1.0 then", "own code has changed"):
        assert words in text


@pytest.mark.drill
def test_code_of_a_plug_in_is_among_the_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study does not outlive the code of an engine's package, edited without a new version; nothing imports it."""
    package = tmp_path / "edited_engine"
    (package / "inside").mkdir(parents=True)
    (package / "__init__.py").write_text("raise RuntimeError('imported')")
    info = tmp_path / "edited-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: edited\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[proofroll.engines]\nedited = edited_engine.adapter:Engine\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = study_store.conditions_now()
    assert study_store.changes(before) == []
    (package / "inside" / "method.py").write_text("order = 1")
    (change,) = study_store.changes(before)
    assert change.startswith("code of edited_engine ")
