"""One tolerance at every door: the same text at ``compare`` and ``judge``."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import proofroll as rolled
from proofroll.core.errors import InputError
from proofroll.running.idle_workers import Workers
from proofroll.studies.comparison.by_name import comparison_named

Proofroll = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A table of a pendulum's tip that is off by 0.1 mm."""
    true = rolled.simulate(rolled.load_scene("pendulum"), "truth", until=0.2, every=0.05)
    path = tmp_path_factory.mktemp("table") / "run.csv"
    columns = np.column_stack([true["time"].values, true["tip.x"].values + 1e-4])
    np.savetxt(path, columns, delimiter=",", header="time,tip.x", comments="")
    return path


@pytest.mark.parametrize(
    ("texts", "code"),
    [(["1 mm"], 0), (["10 um"], 1), (["1 %"], 0), (["1e-2"], 0), (["1e-6 of path"], 1), (["tip.x=1 mm"], 0)],
)
def test_judge_takes_a_tolerance_without_a_name(proofroll: Proofroll, table: Path, texts: list[str], code: int) -> None:
    """A length, a percentage or a part of the path bounds what the file gives; a name bounds one variable."""
    options = [part for text in texts for part in ("--tolerance", text)]
    assert proofroll("judge", str(table), "pendulum", *options)[0] == code


@pytest.mark.parametrize(("bound", "differing"), [("1 mm", set()), ("10 um", {"positions", "p_WB"})])
def test_judge_bounds_each_place_of_a_run(bound: str, differing: set[str]) -> None:
    """Of a whole run a length bounds the main motion and the places of all bodies, as at every other door."""
    run = rolled.simulate(rolled.load_scene("pendulum"), "truth", until=0.2, every=0.05)
    run["p_WB"] = run["p_WB"] + 1e-4
    run["positions"] = run["positions"] + 1e-4
    judged = rolled.judge(run, "pendulum", bound)
    names = {item.judgement.observable: item.judgement.verdict.value for item in judged.compared}
    assert {"positions", "p_WB"} <= names.keys()
    assert {name for name, verdict in names.items() if verdict == "differs"} == differing


def test_a_length_bounds_no_angle(proofroll: Proofroll, tmp_path: Path) -> None:
    """A table without any length is refused a tolerance in metres, with what it gives."""
    true = rolled.simulate(rolled.load_scene("pendulum"), "truth", until=0.2, every=0.05)
    columns = np.column_stack([true["time"].values, true["q.pivot"].values])
    np.savetxt(tmp_path / "run.csv", columns, delimiter=",", header="time,q.pivot", comments="")
    code, _, told = proofroll("judge", str(tmp_path / "run.csv"), "pendulum", "--tolerance", "1 mm")
    assert (code, "q.pivot [rad]" in " ".join(told.split())) == (2, True)


@pytest.mark.drill
def test_a_comparison_of_a_scene_is_judged_by_it() -> None:
    """The bands of a default comparison bound what the tolerance bounds, and say why; a file keeps its own."""
    workers = Workers()
    made = comparison_named("pendulum", {}, workers, None, engines=["projection"], tolerance=["1 mm"])
    (band,) = made.bands.values()
    assert set(band.bounds) == {"positions", "p_WB"}
    assert {bound.value for bound in band.bounds.values()} == {1e-3}
    assert band.because == "1 mm was asked for"
    with pytest.raises(InputError, match="has its own"):
        comparison_named("stick_slip", {}, workers, None, tolerance=["1 mm"])


@pytest.mark.drill
def test_a_line_that_judge_proposes_asks_the_same_question(
    proofroll: Proofroll, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It has all that was given, parameters, tolerance and reason too, and run as it stands it closes the cause."""
    monkeypatch.chdir(tmp_path)
    scene = rolled.load_scene("pendulum", length=0.6)
    true = rolled.simulate(scene, "truth", until=0.5, every=0.05)
    columns = np.column_stack([true["time"].values, np.degrees(true["q.pivot"].values)])
    np.savetxt("mine.csv", columns, delimiter=",", header="t,theta", comments="", fmt="%.17g")
    asked = ["--set", "length=0.6", "--tolerance", "q.pivot=1e-6 rad", "--because", "a table shows no less"]
    code, out, _ = proofroll("judge", "mine.csv", "--scene", "pendulum", *asked, "--map", "t=time,theta=q.pivot")
    line = " ".join(out.partition("Say so: ")[2].partition("All quantities")[0].split())
    assert code == 1, out
    assert shlex.split(line)[2:-2] == ["mine.csv", "--scene", "pendulum", *asked]
    code, out, _ = proofroll(*shlex.split(line)[1:])
    assert code == 0, out
