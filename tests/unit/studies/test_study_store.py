"""Studies that are kept: believed while what they hang on is what it was, under names that do not collide."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import pytest
from invented import invented_study, measured_point

from proofroll.studies import study_identity
from proofroll.studies.stability import stability_path
from proofroll.studies.stability_claims import file_for
from proofroll.studies.stability_places import QUICK, Effort
from proofroll.studies.study_store import keep, kept
from proofroll.studies.tradeoff_records import Corner, TradeoffStudy


@dataclasses.dataclass
class Study:
    """The least that can be kept."""

    points: list[int]
    measured: study_identity.Measured


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A study that was kept just now."""
    path = tmp_path / "study.json"
    keep(Study([1], study_identity.measured()), path)
    return path


def changed(path: Path, **values: Any) -> Path:
    """The same file with something else in what it was measured with."""
    study, _ = kept(path, Study)
    assert study is not None
    keep(dataclasses.replace(study, measured=dataclasses.replace(study.measured, **values)), path)
    return path


def test_a_study_of_this_code_on_this_machine_holds(path: Path) -> None:
    """It comes back as it was put, and nothing speaks against it."""
    study, reasons = kept(path, Study)
    assert study is not None
    assert (study.points, reasons) == ([1], [])


def test_parameters_without_a_bound_come_back(tmp_path: Path) -> None:
    """Friction that nothing exceeds is no number of JSON, and yet a parameter that somebody may set."""
    unbounded = {"mu_static": math.inf}
    point = measured_point(corners=[Corner(unbounded, {}, {}, "it fell")])
    study = invented_study(point, parameters=unbounded, over={"mu_static": [0.3, math.inf]})
    keep(study, tmp_path / "study.json")
    assert kept(tmp_path / "study.json", TradeoffStudy) == (study, [])


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
    study, reasons = kept(changed(path, **values), Study)
    assert study is None
    assert any(reason.startswith(words) for reason in reasons), reasons


def test_a_study_that_was_tampered_with_does_not(path: Path) -> None:
    """One number that is not what was put there, and it is not given."""
    path.write_text(path.read_text().replace('"points": [1]', '"points": [2]'))
    assert kept(path, Study) == (None, ["what is stored is not what had been put there"])


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
    assert kept(tmp_path / "study.json", Study) == (None, [])
    assert kept(tmp_path / "nothing.json", Study) == (None, [])


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
