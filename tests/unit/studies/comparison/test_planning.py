"""What a comparison asks of truths and engines, and what is refused of it before anything runs."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from proofroll.core.comparison import Band, Edge, Row, Tolerance
from proofroll.core.errors import InputError
from proofroll.core.observable import Role
from proofroll.core.verdict import Verdict
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import load_scene, read_scene_file
from proofroll.report.comparison.summary import outcome_content
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison import default_comparison as first_look
from proofroll.studies.comparison import planning
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.default_comparison import able


@pytest.mark.drill
def test_a_wrong_setting_is_found_before_anything_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A setting that does not exist is told with file and row, before the truth looks for the edge of a stair."""

    def ran(*_: object) -> None:
        raise AssertionError("the truth was run first")

    monkeypatch.setattr(planning, "with_edges", ran)
    comparison = load_comparison("stick_slip")
    rows = [Row(engine, comparison.rows[0].tolerance) for engine in ("projection", "projection[step=1]")]
    said = r"stick_slip\.toml: rows\.1\.engine = 'projection\[step=1\]'.*no such setting"
    with pytest.raises(InputError, match=said):
        planning.plan(dataclasses.replace(comparison, rows=rows))


@pytest.mark.drill
def test_a_ladder_asks_for_no_tolerance_of_1_or_more() -> None:
    """Of a tolerance of a tenth no decades up are asked for, where nothing would be computed."""
    comparison = load_comparison("accuracy")
    row = Row("projection[formulation=euler,rtol=0.1]", comparison.rows[0].tolerance, ladder=[4.0, 2.0, 1.0, 0.5])
    found = planning.plan(dataclasses.replace(comparison, rows=[row]), ["projection"])
    asked = {case.engine.settings["rtol"] for run in found.runs for case in run.ladder.values()}
    assert sorted(asked) == pytest.approx([0.01, 0.1])


def test_the_truth_gives_all_that_can_be_asked_for() -> None:
    """Of the truth everything is asked, so that a replay need invent nothing; of engines only what the scene asks."""
    found = planning.plan(load_comparison("accuracy"), ["projection"])
    assert {case.asks for case in found.truths.values()} == {("orientation",)}
    assert {case.asks for run in found.runs for case in run.ladder.values()} == {()}


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("step", "factors"), [(2.5e-4, [4.0, 2.0, 1.0]), (1e-3, [2.0, 1.0, 0.5]), (2e-3, [1.0, 0.5, 0.25])]
)
def test_a_ladder_fits_between_the_samples(step: float, factors: list[float]) -> None:
    """Steps of the usual ladder that do not divide the interval between samples, 0.01 s, are finer ones instead."""
    comparison = dataclasses.replace(load_comparison("accuracy"), until=0.1, every=0.01)
    row = Row(f"mujoco[formulation=chart,dt={step}]", comparison.rows[0].tolerance)
    found = planning.plan(dataclasses.replace(comparison, rows=[row]), ["mujoco"])
    assert {tuple(run.row.ladder) for run in found.runs} == {tuple(factors)}
    assert all(run.ladder.keys() == set(factors) for run in found.runs)


@pytest.mark.drill
def test_two_rows_at_twelve_points_ask_for_20_further_runs_at_first() -> None:
    """A sweep has the ladder at five points, where at all twelve it would have 48 further runs."""
    comparison = load_comparison("accuracy")
    rows = [Row(f"mujoco[formulation=chart,dt={step}]", comparison.rows[0].tolerance) for step in (1e-3, 5e-4)]
    speeds = [1.0 + number for number in range(12)]
    asked = dataclasses.replace(comparison, rows=rows, until=0.1, every=0.02, vary={"speed": speeds}, points=[])
    found = planning.plan(asked)
    assert len(found.ladders) == 48
    assert len(found.first_cases) == 12 + 2 * 12 + 20
    assert not any(run.spare for run in planning.plan(dataclasses.replace(asked, vary={"speed": speeds[:5]})).runs)


@pytest.mark.parametrize(
    ("count", "brief", "chosen"),
    [
        (12, [], [0, 3, 6, 8, 11]),
        (12, [3, 4], [0, 3, 4, 6, 11]),
        (12, [*range(8)], [0, 2, 4, 5, 7]),
        (3, [1], [0, 1, 2]),
    ],
)
def test_the_points_with_a_ladder_are_spread(count: int, brief: list[int], chosen: list[int]) -> None:
    """Those of a brief report come first, the others lie from the first point to the last."""
    points = [{"speed": float(number)} for number in range(count)]
    found = planning._ladder_points(points, [points[number] for number in brief])
    assert sorted(point["speed"] for point in found) == chosen


def test_a_comparison_without_motion_is_refused() -> None:
    """An end at the start, where every engine is right, is one line."""
    with pytest.raises(InputError, match=r"until = 0\.0: the value must be above 0"):
        first_look.default_comparison("pendulum", {}, until=0.0)


@pytest.mark.parametrize(
    ("own_step", "duration", "interval"), [(0.0, 0.3, 0.008), (2e-3, 0.3, 0.008), (5e-3, 0.3, 0.02), (7e-3, 0.2, 0.004)]
)
def test_the_step_of_a_file_divides_the_interval(own_step: float, duration: float, interval: float) -> None:
    """A first look samples at steps of the file's own row, where at least ten samples are left."""
    file = dataclasses.replace(read_scene_file("pendulum"), duration=duration, every=None)
    assert first_look.times_of(file, own_step)[1] == pytest.approx(interval, rel=1e-12)


@pytest.mark.drill
@pytest.mark.parametrize("budget", [60.0, None], ids=["compare", "report"])
def test_what_is_not_determined_is_not_asked(tmp_path: Path, budget: float | None) -> None:
    """A first look at a box at rest judges its motion, and says that its corners share their forces in no known way."""
    made = first_look.default_comparison("pushed_box", {}, engines=["pinocchio"], until=0.05)
    bounds = {**made.bands["close"].bounds, "contact_forces": Tolerance(0.01, relative=True)}
    made = dataclasses.replace(made, budget=budget, bands={"close": Band("a first look", bounds)})
    outcome = compare(made, Runner(Store(tmp_path)))
    (run,) = outcome.runs
    assert run.verdict is Verdict.AGREES
    assert not any(item.observable == "contact_forces" for item in run.judgements)
    assert "Not determined by the equations, and so not judged: contact_forces." in outcome_content(outcome).truth_ends


@pytest.mark.drill
def test_a_first_look_takes_the_step_that_a_scene_asks_for() -> None:
    """Engines with a fixed step have that of the scene's file where their own is longer; adaptive ones have theirs."""
    engines = [row.engine for row in first_look.default_comparison("andrews_squeezer", {}).rows]
    assert "exudyn[formulation=redundant,dt=0.0001]" in engines
    assert "projection[formulation=dependent]" in engines


@pytest.mark.drill
def test_a_formulation_is_offered_for_what_it_is_made_for() -> None:
    """Formulations of contact are in a first look at bodies that touch, and not where another is the same model."""
    touching, swinging = (able(load_scene(name)) for name in ("sled", "double_pendulum"))
    assert {"mujoco[formulation=geoms]", "exudyn[formulation=spheres]"} <= set(touching)
    assert not {"mujoco[formulation=geoms]", "exudyn[formulation=spheres]"} & set(swinging)
    assert "mujoco[formulation=joints]" in swinging


def test_a_point_with_an_edge_is_named_by_its_ends() -> None:
    """Two points that differ only in where an edge is looked for have names of their own."""
    near, far = ({"speed": 4.0, "mu_static": Edge((0.1, end))} for end in (0.2, 0.3))
    assert planning.point_name(near) == "speed=4, mu_static=0.1…0.2"
    assert planning.point_name(far) == "speed=4, mu_static=0.1…0.3"


def test_engines_come_before_witnesses() -> None:
    """Of a budget, all steps of engines that may be taken come before runs that cross-check the truth."""
    comparison = first_look.default_comparison("pendulum", {}, engines=["projection", "mujoco"], until=0.1)
    stages = [[case.engine.witness for case in cases] for cases in planning.plan(comparison).stages]
    assert stages[0] == [False]
    flat = [witness for cases in stages[1:] for witness in cases]
    assert flat == sorted(flat)
    assert set(flat) == {False, True}


def test_an_engine_without_a_row_is_named_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first look names the installed engines that have no formulation for its scene, and what they lack."""
    module = "proofroll.studies.comparison.default_comparison"
    monkeypatch.setattr(f"{module}.engine_names", lambda: ["projection", "reduced"])
    comparison = first_look.default_comparison("stop", {}, until=0.1)
    assert list(comparison.unfit) == ["reduced"]
    assert comparison.unfit["reduced"].startswith("lacks ")
    assert "stops of joints" in comparison.unfit["reduced"]


@pytest.mark.parametrize(("name", "bound"), [("gear_pair", "coupling."), ("driven_four_bar", "drive.")])
def test_forces_of_what_drives_and_couples_are_judged(name: str, bound: str) -> None:
    """A first look at a driven or coupled scene has bounds on these forces."""
    scene = load_scene(name)
    names = [key for key in first_look.bounds(scene, 0.01) if key.startswith(bound)]
    assert names
    assert all(scene.observables[key].role is Role.REACTION for key in names)


def test_a_first_look_judges_contact_forces_attitudes_and_events() -> None:
    """Bounds as those of a judgement without tolerances."""
    found = first_look.bounds(load_scene("sled"), 0.01)
    assert {"contact_forces", "net_forces", "attitudes", "event_times"} <= found.keys()
    assert found["contact_forces"].absolute(100.0) == pytest.approx(1.0)
