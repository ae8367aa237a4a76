"""``proofroll compare`` of a scene about which no file says anything."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from mixed_scene import BALL_AND_PENDULUM

from proofroll.cli.comparing import _Comparing, mention_absent
from proofroll.files.comparison_file import load_comparison
from proofroll.running.time_budget import TimeBudget


@pytest.mark.nightly
@pytest.mark.own_workers
def test_each_engine_is_started_once(
    tmp_path: Path,
    command_line: Callable[..., tuple[int, str, str]],
    monkeypatch: pytest.MonkeyPatch,
    started_workers: list[str],
) -> None:
    """An engine that was asked whether it can represent the scene runs it in the same process."""
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison.engine_names", lambda: ["reduced"])
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison._UNTIL", 0.1)
    assert command_line("compare", "sphere_in_cylinder", "--out", str(tmp_path))[0] == 0
    assert sorted(started_workers) == ["reduced", "truth"]


@pytest.mark.nightly
@pytest.mark.own_workers
def test_engines_that_are_not_asked_for_are_not_started(
    tmp_path: Path, command_line: Callable[..., tuple[int, str, str]], started_workers: list[str]
) -> None:
    """A first look at one engine starts no other."""
    code, _, err = command_line(
        "compare", "pendulum", "--engine", "projection", "--until", "0.1", "--out", str(tmp_path)
    )
    assert (code, err) == (0, "")
    assert set(started_workers) == {"projection", "truth"}


def test_engines_that_are_not_installed_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    """A line names the engines of this package that are not installed, with the line of pip; others say why."""
    lack = "{0} is not installed here ({0} is missing): pip install 'proofroll[{0}]'"
    mention_absent({name: lack.format(name) for name in ("exudyn", "mujoco")} | {"rapier": "rapier needs rust"})
    said = capsys.readouterr().err.splitlines()
    first = "proofroll: not installed here, so not compared: exudyn, mujoco; pip install 'proofroll[exudyn,mujoco]'"
    assert said == [first, "proofroll: rapier needs rust"]


@pytest.fixture
def mixed(tmp_path: Path) -> Path:
    """A scene of a ball and a mechanism."""
    folder = tmp_path / "mixed"
    folder.mkdir()
    (folder / "scene.toml").write_text(BALL_AND_PENDULUM, encoding="utf-8")
    return folder


@pytest.mark.nightly
def test_a_scene_of_two_kinds_is_compared(
    tmp_path: Path, mixed: Path, command_line: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each formulation that is for both elements has a row."""
    monkeypatch.setattr(
        "proofroll.studies.comparison.default_comparison.engine_names", lambda: ["projection", "reduced"]
    )
    code, out, err = command_line("compare", str(mixed), "--out", str(tmp_path / "out"), "--json")
    assert code == 0, err
    found = {row["engine"]: row["verdict"] for row in json.loads(out)["rows"]}
    assert found == {"projection[formulation=dependent]": "agrees"}  # of a mechanism `reduced` has no equations
    monkeypatch.chdir(tmp_path)
    assert command_line("new", "comparison", "look", "--scene", str(mixed))[0] == 0
    assert [row.engine for row in load_comparison("look.toml").rows] == ["projection[formulation=dependent]"]


TENDON = """<mujoco><worldbody>
  <body name="a"><joint name="j" type="hinge" axis="0 1 0"/><inertial pos="0 0 -0.3" mass="1" diaginertia="1 1 1"/>
    <site name="s" pos="0.1 0 -0.3"/></body>
  <body name="b" pos="0.4 0 0"><site name="t"/></body>
</worldbody>
<tendon><spatial stiffness="20"><site site="t"/><site site="s"/></spatial></tendon></mujoco>"""


@pytest.mark.nightly_of("asked1")
@pytest.mark.nightly
@pytest.mark.parametrize("asked", [(), ("--engine", "mujoco")])
def test_what_no_engine_takes_has_a_row_of_each_with_its_reason(
    asked: tuple[str, ...],
    tmp_path: Path,
    command_line: Callable[..., tuple[int, str, str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Engines that all refuse a file judge nothing, exit 3, and each row names what is lacking, and nothing else."""
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison.engine_names", lambda: ["mujoco", "reduced"])
    (tmp_path / "tendon.xml").write_text(TENDON, encoding="utf-8")
    out_folder = ("--out", str(tmp_path / "out"), "--json")
    code, out, err = command_line("compare", str(tmp_path / "tendon.xml"), *asked, *out_folder)
    assert code == 3, err
    rows = {row["engine"]: row for row in json.loads(out)["rows"]}
    assert rows.keys() == ({"mujoco"} if asked else {"mujoco", "reduced"})
    assert {row["verdict"] for row in rows.values()} == {"refused"}
    assert "needs the tendon spatial tendon0 (couplings=0 leaves it out); no formulation" in rows["mujoco"]["reason"]


@pytest.mark.nightly
def test_two_kinds_that_no_engine_has_together(
    tmp_path: Path, mixed: Path, command_line: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An engine that lacks one of the kinds of a scene has a row with what it lacks."""
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison.engine_names", lambda: ["reduced"])
    code, out, err = command_line("compare", str(mixed), "--until", "0.1", "--out", str(tmp_path / "out"), "--json")
    assert code == 3, err
    (row,) = json.loads(out)["rows"]
    assert (row["engine"], row["verdict"]) == ("reduced", "refused")
    assert "needs revolute joints; no formulation of reduced's adapter has that" in row["reason"]


@pytest.mark.nightly
def test_a_first_look_stays_within_its_budget(
    tmp_path: Path, command_line: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Truth and runs come first; what is left out is named with the option that brings it, and nothing is stored."""
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison.engine_names", lambda: ["reduced"])
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison._UNTIL", 0.1)
    begun: list[str] = []

    def short(_: TimeBudget, case: str, __: int) -> float:
        begun.append(case)
        return 0.0 if len(begun) > 2 else 60.0

    with monkeypatch.context() as patch:
        patch.setattr("proofroll.running.time_budget.TimeBudget.begin", short)
        patch.setattr("proofroll.running.time_budget.TimeBudget.end", lambda *_, **__: None)
        code, out, err = command_line("compare", "sphere_in_cylinder", "--out", str(tmp_path), "--jobs", "1")
    assert code == 0, err
    said = "Not run (budget of 60 s used up): reduced[formulation="
    assert said in " ".join(out.split())
    assert "--budget 600" in out.replace("\n", " ")
    code, out, err = command_line("compare", "sphere_in_cylinder", "--out", str(tmp_path), "--json", "--budget", "50")
    content = json.loads(out)
    assert (content["budget"], content["beyond_budget"]) == (50, [])
    assert {row["verdict"] for row in content["rows"]} == {"agrees"}


@pytest.mark.nightly
def test_rows_that_exist_are_shown_where_a_comparison_is_interrupted(
    tmp_path: Path, command_line: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C after the first run: its row is in the table, what is missing is named, and the exit code is 130."""
    from proofroll.running.runner import Runner

    follow = Runner.follow

    def one(runner: Runner, cases: Any, then: Any, *others: Any) -> Any:
        cases = list(cases)
        told = follow(runner, cases[:1], then, *others)
        if cases and cases[0].engine.name != "truth":
            raise KeyboardInterrupt
        return told

    monkeypatch.setattr(Runner, "follow", one)
    asked = ("--engine", "reduced", "--until", "0.1", "--out", str(tmp_path), "--jobs", "1")
    code, out, err = command_line("compare", "sphere_in_cylinder", *asked)
    assert code == 130, err
    assert "does not" not in out
    assert "· " in out
    assert "not run" in out


def test_the_time_that_is_left_is_never_less_than_none() -> None:
    """While results that are kept are being judged, a line says nothing about the rest; later it counts what ran."""
    said: list[str] = []
    runner: Any = SimpleNamespace(reused=0, jobs=1)
    running = _Comparing([], runner, None, None)
    running.tell = said.append
    running.keys = set("abcdefgh")
    for running.runner.reused, running.results in ((6, {"a": None}), (6, dict.fromkeys("abcdefg"))):  # type: ignore[assignment]
        running._tell(SimpleNamespace(engine=SimpleNamespace(name="mujoco", resolution=None, settings={})))  # type: ignore[arg-type]
    assert said[0] == "MuJoCo"
    assert said[1].startswith("about ")
    assert "-" not in said[1].partition(" s left")[0].replace("e-", "")
    running._start -= 50.0
    running._tell(SimpleNamespace(engine=SimpleNamespace(name="mujoco", resolution=None, settings={})))  # type: ignore[arg-type]
    assert said[2].startswith("about 50 s left"), "for a person, without a power of ten"


def test_a_spent_budget_leaves_the_time_to_judge() -> None:
    """Of 100 s the runs have used 90: the 10 s that are kept for judging are told, and not 0 s."""
    said: list[str] = []
    runner: Any = SimpleNamespace(reused=0, jobs=1)
    running = _Comparing([], runner, TimeBudget(100.0, spent=90.0), None)
    running.tell = said.append
    running.keys, running.results, running._budget = set("abcdefgh"), {"a": None}, 90.0  # type: ignore[assignment]
    running._start -= 90.0
    running._tell(SimpleNamespace(engine=SimpleNamespace(name="mujoco", resolution=None, settings={})))  # type: ignore[arg-type]
    assert said[0].startswith("about 10 s left")


def test_what_judging_took_is_kept_of_a_budget_for_the_end() -> None:
    """Four of twelve cases took 6 s to judge and to write, so all that have ended by now are given 12 s."""
    budget = TimeBudget(100.0)
    runner: Any = SimpleNamespace(reused=0, jobs=1)
    running = _Comparing([], runner, budget, None)
    running._judging, running._judged, running.results = 6.0, {0: 4}, dict.fromkeys("abcdefgh")  # type: ignore[assignment]
    running._keep_for_the_end()
    assert budget.after == 12.0


def test_a_budget_is_for_scenes(command_line: Callable[..., tuple[int, str, str]]) -> None:
    """A comparison file runs all that it asks for, and a cluster has no budget: both are said."""
    code, _, err = command_line("compare", "paper", "--budget", "10")
    assert code == 2
    assert "a comparison file runs all that it asks for" in err
    code, _, err = command_line("compare", "pendulum", "--budget", "10", "--scheduler", "local:1")
    assert code == 2
    assert "runs on a cluster have none" in err
