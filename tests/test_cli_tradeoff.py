"""``proofroll tradeoff`` as a user meets it."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pyperf
import pytest
from rich.console import Console

from proofroll.report import labels
from proofroll.report.tradeoff.tables import corner_table
from proofroll.report.tradeoff.work_precision import svg
from proofroll.studies import study_store
from proofroll.studies.study_store import keep_study
from proofroll.studies.tradeoff.curve import Question
from proofroll.studies.tradeoff.records import MeasuredPoint, TradeoffStudy
from proofroll.studies.tradeoff.tradeoff import Extent, study_path

Proofroll = Callable[..., tuple[int, str, str]]
ENGINE = "exudyn[formulation=carrier,preset=matched]"


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> TradeoffStudy:
    """A real trade-off of two curves over half a second, and of a range of two speeds."""
    from proofroll.running.runner import Runner
    from proofroll.running.store import Store
    from proofroll.studies.tradeoff.study import tradeoff_study
    from proofroll.studies.tradeoff.tradeoff import tradeoff

    question = Question("sphere_in_cylinder", {"rolling_resistance": 5e-4}, 0.5, "z")
    engines = [ENGINE, "mujoco[formulation=chart,preset=default]"]
    extent = Extent(engines, over={"speed": [3, 5]}, rounds=2)
    found = tradeoff(question, Runner(Store(tmp_path_factory.mktemp("cases"))), extent)
    return tradeoff_study(found)


@pytest.fixture
def folder(measured: TradeoffStudy, tmp_path: Path) -> Path:
    """A folder with that study in it, as if it had just been made with this code on a machine without noise."""
    path = study_path(tmp_path, Question("sphere_in_cylinder", {"rolling_resistance": 5e-4}, 0.5, "z"))
    path.parent.mkdir()
    points = []
    for point in measured.points:
        cost = 1e-5 / (point.step or 1.0)
        steady = replace(point, seconds_per_second=cost, interval=(0.99 * cost, 1.01 * cost))
        points.append(point if point.seconds_per_second is None else steady)
    keep_study(replace(measured, measured=study_store.conditions_now(), points=points), path)
    return tmp_path


@pytest.mark.drill
def test_curves_reach_from_broken_to_fine(measured: TradeoffStudy) -> None:
    """Each curve has six points or more, coarse first; the good one begins broken and ends a thousandfold better."""
    curves: dict[str, list[MeasuredPoint]] = {}
    for point in measured.points:
        curves.setdefault(point.engine, []).append(point)
    assert {name: len(points) >= 6 for name, points in curves.items()} == {"exudyn": True, "mujoco": True}
    steps = [point.step for point in curves["exudyn"]]
    assert steps == sorted(steps, reverse=True)
    errors = [point.error["z"] for point in curves["exudyn"] if point.status == "done"]
    assert errors[-1] < 1e-3 * errors[0]
    assert min(point.error["z"] for point in curves["mujoco"] if point.status == "done") > 0.003


def test_every_point_has_a_cost_with_its_interval(measured: TradeoffStudy) -> None:
    """A run that reached the end has a positive cost within its interval, from so many rounds."""
    done = [point for point in measured.points if point.status == "done"]
    for point in done:
        assert 0 < point.interval[0] <= point.seconds_per_second <= point.interval[1]
        assert len(point.rounds) == point.measurements == 2


def test_the_truth_has_a_cost_with_its_interval(measured: TradeoffStudy) -> None:
    """It was measured in turns with the points, and not once."""
    truth = measured.truth
    assert 0 < truth.interval[0] <= truth.seconds_per_second <= truth.interval[1]
    assert truth.interval[0] < truth.interval[1]


def test_budget_of_a_good_and_of_a_soft_model(measured: TradeoffStudy) -> None:
    """The trapezoidal rule shows its order 2 and no error of the model; MuJoCo's default contact shows one of cm."""
    budgets = {item.engine: item for item in measured.budgets if item.quantity == "z"}
    good, soft = budgets["exudyn"], budgets["mujoco"]
    assert good.order_low - 0.1 < 2 < good.order_high + 0.1
    assert good.order_from > good.order_to > 0
    assert good.model_form < 1e-8
    assert soft.model_form > 0.003
    assert soft.fine == "model form"


def test_every_run_is_counted(measured: TradeoffStudy) -> None:
    """Runs that were refused, that ended early and that are silently wrong are told apart."""
    status = [point.status for point in measured.points]
    scale = measured.quantities["z"].scale
    wrong = sum(p.status == "done" and p.error["z"] > 0.1 * scale for p in measured.points)
    refused = status.count("refused")
    ended = len(status) - refused - status.count("done")
    said = measured.findings[-1]
    assert said.startswith(f"{len(status)} runs: {refused} refused, {ended} that did not reach the end")
    assert f"; {wrong} that reached it silently" in said


def test_the_front_is_within_the_points(measured: TradeoffStudy) -> None:
    """Every point of the Pareto front is one of the points, and was run over the range."""
    by_id = {point.id: point for point in measured.points}
    assert measured.pareto["z"]
    for number in measured.pareto["z"]:
        corners = by_id[number].corners or []
        assert [corner.parameters for corner in corners] == [{"speed": 3.0}, {"speed": 5.0}]


def test_an_answer_needs_no_library_of_pages(
    proofroll: Proofroll, measured: TradeoffStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A trade-off has its tables and its JSON without matplotlib; in place of the diagram is how to get it."""
    monkeypatch.setattr(
        sys.modules["proofroll.cli.tradeoff"], "measure", lambda *_: (measured, tmp_path / "study.json")
    )
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "matplotlib" else name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    given = ("tradeoff", "sphere_in_cylinder", "--until", "0.5", "--out", str(tmp_path))
    code, out, err = proofroll(*given, "--json")
    assert (code, err) == (0, "")
    assert json.loads(out)["points"]
    code, out, err = proofroll(*given)
    assert (code, err) == (0, "")
    assert "× real time, cheapest that holds" in out
    assert "no diagram: drawing needs matplotlib: pip install 'proofroll[report]'" in " ".join(out.split())
    assert not list(tmp_path.glob("*.svg"))


@pytest.mark.drill
def test_tradeoff_writes_its_diagram_and_timings(proofroll: Proofroll, tmp_path: Path) -> None:
    """Lines fit 80 columns, and the diagram and pyperf's file are written."""
    given = ["--set", "speed=3", "--until", "0.1", "--engine", ENGINE, "--out", str(tmp_path)]
    code, out, err = proofroll("tradeoff", "sphere_in_cylinder", *given)
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "× real time, cheapest that holds" in out
    assert "order (declared)" not in out
    (drawn,) = (tmp_path / "tradeoff").glob("*.svg")
    assert "Exudyn carrier, matched" in drawn.read_text()
    (timings,) = (tmp_path / "tradeoff").glob("*.pyperf.json")
    assert len(pyperf.BenchmarkSuite.load(str(timings)).get_benchmarks()) >= 6


def test_what_was_found_over_a_range(measured: TradeoffStudy, capsys: pytest.CaptureFixture[str]) -> None:
    """Each point that was run there has its worst corner, within 100 columns, and one without a result says why."""
    points = [point for point in measured.points if point.corners]
    corners = points[-1].corners or []
    last = replace(points[-1], corners=[replace(corners[0], errors={}, message="it fell")])
    study = replace(measured, points=[*points[:-1], last])
    Console(width=100).print(corner_table(study, "z"))
    lines = capsys.readouterr().out.splitlines()
    assert all(len(line) <= 100 for line in lines)
    assert lines[0].strip() == "Over speed 3 to 5: error of z [m]"
    assert "it fell" in " ".join(lines)
    for point in points[:-1]:
        if any("z" not in corner.errors for corner in point.corners or []):
            continue  # it has no result there either
        worst = max(point.corners or [], key=lambda corner: corner.errors["z"])
        expected = f"{labels.number(worst.errors['z'])} speed = {worst.parameters['speed']:g}"
        assert any(expected in " ".join(line.split()) for line in lines)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--quantity", "colour"], "quantity = 'colour'"),
        (["--quantity", "first_slip"], "--set mu_static="),
        (["--engine", "adams"], "engine = 'adams'"),
        (["--engine", "exudyn[formulation=none]"], "exudyn has carrier"),
        (["--quantity", "z", "--quantity", "colour"], "quantity = 'colour'"),
        (["--over", "speed"], "--over = 'speed'"),
        (["--over", "speed=2"], "parameter=low:high"),
        (["--over", "speed=6:2"], "the lower end first"),
        (["--over", "colour=2:6"], "colour = 2.0"),
        (["--over", "speed=fast:faster"], "parameter=low:high"),
        (["--until", "0"], "positive, finite time"),
        (["--set", "speed=0"], "speed = '0'"),
    ],
)
def test_a_trade_off_that_makes_no_sense(proofroll: Proofroll, tmp_path: Path, more: list[str], words: str) -> None:
    """Bad input is one line that names the field, before anything runs, and exit code 2."""
    code, out, err = proofroll("tradeoff", "sphere_in_cylinder", "--out", str(tmp_path), *more)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
    assert not list(tmp_path.glob("**/*.npz"))


@pytest.mark.drill
def test_the_diagram_says_what_was_run(measured: TradeoffStudy) -> None:
    """It names scene, parameters and length, and one front where no equations of the scene's own are on another."""
    drawn = svg(measured, ["z", "N"])
    assert "sphere_in_cylinder, rolling_resistance = 0.0005, over 0.5 s" in drawn
    assert "Pareto front of the engines" in drawn
    assert "own equations" not in drawn
    other = measured.pareto_engines | {"z": measured.pareto["z"][1:]}
    assert "own equations" in svg(replace(measured, pareto_engines=other), ["z"])
