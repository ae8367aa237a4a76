"""The matrix of arithmetic: it computes otherwise, notices what hangs on that, and the truths' numbers do not."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import near_bounds
import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.errors import InputError
from proofroll.files.comparison_file import load_comparison
from proofroll.files.trajectory_file import read
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll_drill.arithmetic import matrix as the_matrix
from proofroll_drill.arithmetic.differences import beyond_bars, differences, late
from proofroll_drill.arithmetic.kinds import PYTHONS, REPOSITORY, Arithmetic, kinds, took_effect
from proofroll_drill.arithmetic.matrix import Tried, comparison_files, matrix
from proofroll_drill.arithmetic.record import WRONG, decided, unhurried, until_wrong
from proofroll_drill.arithmetic.studies import decided_by, is_study
from proofroll_drill.command import drill
from proofroll_drill.table import arithmetic_lines

# A ball that rolls, one that slips and sticks, one on a curved wall; a body in space, a tree, a loop.
SCENES = ("sphere_in_cylinder", "inclined_plane", "bowl", "heavy_top", "four_bar")
_TRUTHS = """
import sys
from pathlib import Path
import numpy as np
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import write
for name in sys.argv[2:]:
    write(truth(load_scene(name), np.linspace(0.0, 0.5, 6)), Path(sys.argv[1]) / f"{name}.npz")
"""
BY_NAME = {kind.name: kind for kind in kinds()}


def truths(kind: Arithmetic, folder: Path) -> Path:
    """The true trajectories of the scenes, of a process with this arithmetic."""
    folder.mkdir()
    subprocess.run([sys.executable, "-c", _TRUTHS, folder, *SCENES], env=kind.variables(folder / "site"), check=True)
    return folder


@pytest.mark.nightly
@pytest.mark.slow
def test_numbers_of_the_truth_hang_on_no_processor(tmp_path: Path) -> None:
    """Numbers of the truth differ under other kernels and instructions by round-off, within their error bars."""
    reference = truths(BY_NAME["reference"], tmp_path / "reference")
    some = False
    for kind in (BY_NAME["prescott"], BY_NAME["no-avx2"]):
        if kind.untried or took_effect(kind, tmp_path / "site"):
            continue
        other = truths(kind, tmp_path / kind.name)
        for name in SCENES:
            one, two = (read(folder / f"{name}.npz") for folder in (reference, other))
            assert list(beyond_bars(one, two)) == []
            some |= any(not np.array_equal(item, two[key]) for key, item in one.items() if item.dtype.kind == "f")
    assert some or sys.platform != "linux"


def record(**changes: Any) -> dict[str, Any]:
    """A record of one run whose truth has no file."""
    run = {"status": "done", "verdict": "agrees", "causes": [], "events": {"ball": ["slip", "stick"]}}
    return {
        "claim": {
            "decisions": {"engine point 0 #0": run | changes},
            "limits": {"engine point 0 #0": {"z": [changes.get("limit", 1e-9), 1e-10]}},
            "truths": {},
        }
    }


@pytest.mark.parametrize(
    "changes", [{"verdict": "differs"}, {"causes": [["ball", "friction"]]}, {"events": {"ball": ["slip"]}}]
)
def test_a_decision_that_differs_is_told(changes: dict[str, Any], tmp_path: Path) -> None:
    """Whatever is decided of a run, with its place, what the reference says, and what was found instead."""
    (found,) = differences("zen", tmp_path, tmp_path, (record(), record(**changes)))
    ((what, instead),) = changes.items()
    place = f"engine point 0 #0: {what}" + (": ball" if what == "events" else "")
    assert (found.kind, found.comparison, found.what) == ("zen", "claim", place)
    assert found.found == str(instead["ball"] if what == "events" else instead)
    assert found.reference != found.found


def test_a_run_whose_package_is_missing_is_no_difference(tmp_path: Path) -> None:
    """A row that needs what one kind lacks is compared with nothing."""
    assert (
        list(differences("no-heyoka", tmp_path, tmp_path, (record(), record(status="missing", verdict="failed")))) == []
    )


@pytest.mark.parametrize("changes", [{"status": "timeout", "verdict": "failed"}, {"limit": 1.0}])
def test_a_run_out_of_time_is_no_difference(changes: dict[str, Any], tmp_path: Path) -> None:
    """A run whose time was up in one kind, or a rung of its ladder, is named and compared with nothing."""
    late_one = record(**changes)
    late_one["claim"]["late"] = ["engine point 0 #0"]
    for records in ((record(), late_one), (late_one, record())):
        assert list(differences("no-heyoka", tmp_path, tmp_path, records)) == []
        assert late(records) == ["claim: engine point 0 #0"]
    truths = record(), record()
    truths[0]["claim"]["truths"]["point 0"] = {"decisions": {"ill_posed": False}, "file": "none"}
    truths[1]["claim"]["late"] = ["truth at point 0"]
    assert list(differences("no-heyoka", tmp_path, tmp_path, truths)) == []
    tried = Tried("no-heyoka", "without heyoka", late=late((record(), late_one)))
    assert list(arithmetic_lines([tried])) == [
        "no-heyoka: claim: engine point 0 #0: ran out of time, so it is compared with nothing"
    ]


@pytest.mark.parametrize(
    ("found", "kept"),
    [
        (["slip", "stick"], ["slip", "stick"]),
        (["slip"], ["slip"]),
        (["slip", "lift_off", "impact", "lift_off"], ["slip", WRONG]),
        (["slip", "stick", "slip", "stick"], ["slip", "stick", WRONG]),
        (["lift_off"] * 8, [WRONG]),
    ],
)
def test_what_follows_a_wrong_event_is_no_decision(found: list[str], kept: list[str]) -> None:
    """An engine whose events are not the truth's may chatter on as round-off has it; where they part counts."""
    assert until_wrong(found, ["slip", "stick"]) == kept


@pytest.mark.nightly
def test_what_a_comparison_decides_is_recorded(tmp_path: Path) -> None:
    """A run with its verdict, its events and its limits, and the truth that it is held against."""
    row = Row("mujoco[formulation=geoms]", "loose", ladder=[1.0, 0.5, 0.25])
    claim = Comparison("claim", "A claim", "Does it hold?", "slide_to_roll", 0.1, 0.02, rows=[row])
    bands = {"loose": Band("as any", {"down": Tolerance(0.01, True, "m")})}
    claim = replace(claim, bands=bands, vary={"speed": [0.2]}, timed=False)
    runner = Runner(Store(tmp_path), jobs=1)
    outcome = compare(claim, runner)
    found = decided(outcome, runner.store)
    assert found["late"] == []
    (run,) = outcome.runs
    slow = replace(run.rungs[0], result=replace(run.rungs[0].result, status=Status.TIMEOUT))
    rungs = replace(run, rungs=[slow, *run.rungs[1:]])
    assert decided(replace(outcome, runs=[rungs]), runner.store)["late"] == list(found["decisions"])
    ((name, point),) = outcome.points.items()
    unknown = {name: replace(point, result=replace(point.result, status=Status.TIMEOUT))}
    said = decided(replace(outcome, points=unknown), runner.store)["late"]
    assert said == [*found["decisions"], "truth at point 0"]
    ((place, run),) = found["decisions"].items()
    assert (run["status"], run["verdict"]) == ("done", outcome.runs[0].verdict)
    assert found["truths"]["point 0"]["decisions"]["events"] == {"ball": ["stick"]}
    assert run["events"]["ball"][0] == "stick"
    assert found["limits"][place]["down"][1] > 0
    assert (tmp_path / found["truths"]["point 0"]["file"]).exists()


REGIMES = """study = "regimes"
title = "Four runs"
question = "Which slip?"
scene = "sphere_in_cylinder"
until = 0.2
rolling_resistance = [0.0]
speed = {low = 1.0, high = 4.0, count = 2}
mu_static = {low = 0.05, high = 0.5, count = 2}
"""


def test_what_a_map_of_regimes_decides_is_recorded(tmp_path: Path) -> None:
    """Regimes and slips of each place of a map, brief; another regime is a difference."""
    (tmp_path / "map.toml").write_text(REGIMES, encoding="utf-8")
    assert is_study(str(tmp_path / "map.toml"))
    found = {"map": decided_by(str(tmp_path / "map.toml"), Runner(Store(tmp_path / "out"), jobs=1))}
    assert [len(said["regime"]) for said in found["map"]["decisions"].values()] == [2, 2]
    other = json.loads(json.dumps(found))
    place = next(iter(other["map"]["decisions"]))
    other["map"]["decisions"][place]["regime"][0] += 1
    (parted,) = differences("zen", tmp_path, tmp_path, (found, other))
    assert parted.what == f"{place}: regime"


@pytest.mark.nightly
def test_what_a_ladder_of_models_decides_is_recorded(tmp_path: Path) -> None:
    """Models that reach their end, and terms that are needed, which hang on no clock."""
    found = decided_by("ladder:double_pendulum", Runner(Store(tmp_path), jobs=1))
    ends = {said["ends"] for said in found["decisions"].values() if "ends" in said}
    verdicts = {said["verdict"] for said in found["decisions"].values() if "verdict" in said}
    assert Status.DONE in ends
    assert "not needed" in verdicts
    assert not verdicts & {"free", "paid for, not needed"}


@pytest.mark.nightly
def test_what_a_map_of_stability_decides_is_recorded(tmp_path: Path) -> None:
    """Largest steps and failures beyond, at each place; the claims that they contradict."""
    axis = '[[axes]]\nname = "speed"\nunit = "1/s"\nmeaning = "of the hinge"\nvalues = [0, 1]\nparameters.speed = {}\n'
    head = 'study = "stability"\ntitle = "One"\nquestion = "Up to which step?"\nscene = "pendulum"\n'
    (tmp_path / "one.toml").write_text(head + axis, encoding="utf-8")
    found = decided_by(str(tmp_path / "one.toml"), Runner(Store(tmp_path / "out"), jobs=1))
    places = [said for place, said in found["decisions"].items() if place != "claims"]
    assert len(places) >= 8
    assert any(said["accurate"][1] for said in places)
    assert found["decisions"]["claims"]["contradicted"] == 0


def test_a_study_that_nothing_compares_is_told_in_a_line(tmp_path: Path) -> None:
    """A study of another kind is refused before any process starts."""
    (tmp_path / "drawn.toml").write_text('study = "figures"\n', encoding="utf-8")
    with pytest.raises(InputError, match="compared are"):
        CliRunner().invoke(drill, ["arithmetic", str(tmp_path / "drawn.toml")], catch_exceptions=False)


def test_a_run_that_is_lacking_is_told(tmp_path: Path) -> None:
    """A comparison that gave other runs is another outcome."""
    without = record()
    without["claim"]["decisions"] = {}
    assert list(differences("zen", tmp_path, tmp_path, (record(), without)))


def test_limits_may_differ_within_their_bars(tmp_path: Path) -> None:
    """Limits count as different beyond the sum of both bars."""
    assert not [
        one
        for one in differences("zen", tmp_path, tmp_path, (record(), record(limit=1.15e-9)))
        if "limit of z" in one.what
    ]
    (found,) = (
        one
        for one in differences("zen", tmp_path, tmp_path, (record(), record(limit=1.3e-9)))
        if "limit of z" in one.what
    )
    assert found.found == "off by 3e-10"


def test_numbers_beyond_their_bars_are_told() -> None:
    """A variable may differ by the bars of both, the time of an event by the brackets of both."""
    import xarray as xr

    def dataset(z: float, event: float) -> xr.Dataset:
        times = {f"event_{name}": ("event", [event + more]) for name, more in (("time", 0), ("low", 0), ("high", 1e-9))}
        return xr.Dataset({"z": ("time", [0.0, z], {"error_bar": 1e-12})} | times)

    one = dataset(1.0, 0.5)
    assert list(beyond_bars(one, dataset(1.0 + 1.9e-12, 0.5 + 1.9e-9))) == []
    assert [name for name, *_ in beyond_bars(one, dataset(1.0 + 2.1e-12, 0.5))] == ["z"]
    assert [name for name, *_ in beyond_bars(one, dataset(1.0, 0.5 + 2.1e-9))] == ["event_time"]


@pytest.mark.nightly
def test_kinds_compute_otherwise(tmp_path: Path) -> None:
    """Each kind that this machine has takes effect in its processes, or says why it cannot be tried."""
    for name in ("haswell", "prescott", "no-avx2", "avx2-machine", "sse-machine", "no-heyoka"):
        kind = BY_NAME[name]
        assert isinstance(kind.untried or took_effect(kind, tmp_path / name), str)
    hidden = BY_NAME["no-heyoka"].variables(tmp_path / "site")
    asked = "from proofroll.core.heyoka_library import available; print(available())"
    done = subprocess.run([sys.executable, "-c", asked], env=hidden, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_what_a_machine_cannot_is_named_as_not_tried(tmp_path: Path) -> None:
    """An interpreter that is not there, and one that does not start, cost their kinds alone."""
    absent = Arithmetic("python9", "Python 9", untried="it is not on this machine")
    broken = Arithmetic("broken", "numpy without what it cannot be without", {"NPY_DISABLE_CPU_FEATURES": baseline()})
    found = matrix([absent, broken], [], out=tmp_path)
    assert [(item.kind, bool(item.untried), item.same) for item in found] == [
        ("python9", True, True),
        ("broken", bool(baseline()), True),
    ]


def test_a_comparison_that_is_not_there_is_told_in_a_line() -> None:
    """A misspelt name is refused before any process starts."""
    with pytest.raises(InputError, match="there is no such comparison"):
        CliRunner().invoke(drill, ["arithmetic", "no_such_rod"], catch_exceptions=False)


def baseline() -> str:
    """A feature that numpy was built with and cannot switch off; empty: there is none."""
    umath = import_module("numpy._core._multiarray_umath")  # numpy has no public name for it

    return str(next(iter(umath.__cpu_baseline__), ""))


def test_slow_arithmetic_has_the_time_it_needs() -> None:
    """Other arithmetic may take several times as long (the governor's truth 14 s, not 3, without heyoka)."""
    asked = load_comparison(str(REPOSITORY / "comparisons" / "mechanisms" / "flyball_governor.toml"))
    assert unhurried(asked).time_limit > 5 * asked.time_limit
    assert not unhurried(asked).timed


@pytest.mark.drill
def test_no_result_of_another_arithmetic_is_used(tmp_path: Path) -> None:
    """A folder that holds results already is refused: what is stored does not say with which kernel it was made."""
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "old.json").write_text("{}")
    command = [sys.executable, "-m", "proofroll_drill.arithmetic.record", str(tmp_path), "1", "1", "heavy_top"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode
    assert "name an empty folder" in done.stderr


def test_tests_that_fail_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Failed tests are named; a run of pytest without tests is no success either; other files are not collected."""
    said = {"out": "FAILED tests/test_it.py::test_it - assert 1 < 0\n1 failed in 1.0s\n"}

    def ran(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        files = {Path(word).name for word in command if word.endswith(".py")}
        assert "test_natural_units.py" in files
        assert "test_cli.py" not in files
        return subprocess.CompletedProcess(command, 1, stdout=said["out"])

    monkeypatch.setattr(the_matrix, "took_effect", lambda *_: "")
    monkeypatch.setattr(the_matrix.subprocess, "run", ran)
    (found,) = matrix([BY_NAME["reference"]], [], "sensitive", tmp_path)
    assert (found.failed, found.same) == (["FAILED tests/test_it.py::test_it - assert 1 < 0"], False)
    said["out"] = "no tests collected\n"
    (found,) = matrix([BY_NAME["reference"]], [], "sensitive", tmp_path)
    assert (found.failed, found.same) == (["no tests collected"], False)
    assert Tried("x", "y").same


def test_a_kind_that_ends_costs_its_own_row_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A kind whose comparisons end by an error is a failed row; the kinds before and after it have theirs."""

    def recorded(kind: Any, *_: Any) -> dict[str, Any]:
        if kind.name == "haswell":
            raise subprocess.CalledProcessError(-9, "python")
        return {}

    monkeypatch.setattr(the_matrix, "took_effect", lambda *_: "")
    monkeypatch.setattr(the_matrix, "_recorded", recorded)
    found = matrix([BY_NAME[name] for name in ("reference", "haswell", "prescott")], ["sled"], "", tmp_path)
    assert [item.same for item in found] == [True, False, True]
    assert found[1].failed == ["its comparisons ended with exit code -9"]


def test_bounds_near_what_is_seen_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bounds near round-off that a difference comes near to are listed; wide ones, and what differs on purpose, not."""
    monkeypatch.setattr(near_bounds, "seen", {})
    for difference, bound in ((0.5, 1e-9), (0.05, 1e-9), (2.0, 1e-9), (0.5, 1e-3)):
        near_bounds.note(1.0 + difference * bound, 1.0, bound)  # each line keeps its nearest
    near_bounds.note(np.array([1.0, 2.0]), np.array([1.0, 2.0]), 1e-9)
    ((place, ratio, part),) = near_bounds.near()
    assert place.startswith("tests/drill/test_arithmetic.py:")
    assert (ratio, part) == (pytest.approx(0.5, abs=1e-3), pytest.approx(1e-9))


def test_bounds_by_less_than_are_listed(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A number just below a small bound is listed with the line of its assertion; counts and distant ones are not."""
    monkeypatch.setattr(near_bounds, "seen", {})
    held = ("4.5e-08 < 1e-07\n  where ...", "np.float64(3e-9) > 1e-09", "1e-12 < 1e-9", "2 <= 3", "error < bound")
    for line, explanation in enumerate(held):
        near_bounds.pytest_assertion_pass(request.node, line, explanation)
    assert [(place[-2:], pytest.approx(ratio)) for place, ratio, _ in near_bounds.near()] == [
        (":0", 0.45),
        (":1", 1 / 3),
    ]


def test_every_comparison_is_in_the_matrix() -> None:
    """Every comparison of this repository, of the folders below, and of articles is in the matrix."""
    found = {Path(name).stem for name in comparison_files()}
    assert {"paper", "stick_slip", "accuracy", "turntable", "andrews_squeezer"} <= found
    assert {"stability", "stability_plane", "regimes", "ladder:double_pendulum"} <= found
    assert {path.stem for path in REPOSITORY.glob("comparisons/*/*.toml")} <= found


def test_declared_pythons_are_those_of_the_matrix() -> None:
    """Pythons declared in ``pyproject.toml`` are those of the matrix and of the continuous integration."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    prefix = "Programming Language :: Python :: "
    assert tuple(item.removeprefix(prefix) for item in project["classifiers"] if item.startswith(prefix)) == PYTHONS
    assert project["requires-python"] == f">={PYTHONS[0]}"
    workflow = yaml.safe_load((REPOSITORY / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    assert tuple(workflow["jobs"]["two-commands"]["strategy"]["matrix"]["python"]) == PYTHONS
