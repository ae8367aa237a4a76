"""What a comparison makes of results: claims about nothing, exceptions, ill-posed questions, missing truths."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hostile import ENTRY_POINTS
from scipy.spatial.transform import Rotation

from proofroll.cli.comparing import exit_code
from proofroll.core.certificate import Line
from proofroll.core.comparison import Band, Comparison, ExceptAt, Row, Tolerance
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.core.truth import truth
from proofroll.core.verdict import Judgement, LimitResult, Verdict
from proofroll.files.scene_file import load_scene, read_scene_file
from proofroll.files.trajectory_file import write
from proofroll.report.comparison.summary import outcome_content
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.runner import Runner
from proofroll.running.simulation import simulate
from proofroll.running.store import Store
from proofroll.running.time_budget import TimeBudget
from proofroll.studies.comparison.compare import affordable, compare, evaluate, run_plans, run_within_budget
from proofroll.studies.comparison.expectations import contradictions_of
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.comparison.planning import Plan, Planned, point_name

FACTS = EngineFacts("alpha", "1", "code", {"dt": 1e-3}, "dt", 2)
TRUTH = EngineFacts("truth", "1", "code", {})
ROW = Row("alpha", "tight", ladder=[1.0])
TIGHT = {"gamma": Tolerance(1e-9, False, "rad"), "z": Tolerance(1e-9, False, "m")}

Answer = Callable[[Scene, xr.Dataset], xr.Dataset | Result]


def claim(rows: list[Row], speeds: list[float], bounds: Mapping[str, Tolerance] | None = None) -> Comparison:
    """A comparison at some speeds."""
    band = Band("the engine gives the truth", dict(bounds or TIGHT))
    vary = {"speed": speeds}
    comparison = Comparison("claim", "A claim", "Does it hold?", "sphere_in_cylinder", 0.4, 0.02, vary=vary)
    return dataclasses.replace(comparison, bands={"tight": band}, rows=rows)


@cache
def true_motion(
    name: str, point: tuple[tuple[str, float], ...], until: float, every: float, between: tuple[float, ...]
) -> xr.Dataset:
    """The truth of a scene with all that can be asked, found once for all tests."""
    return truth(load_scene(name, **dict(point)).fully_asked, time_grid(until, every), between=np.array(between))


def judged(
    folder: Path,
    comparison: Comparison,
    answer: Answer,
    true: Mapping[float, Result | xr.Dataset] | None = None,
    rungs: Mapping[float, Answer] | None = None,
    certificate: Sequence[Line] = (),
    between: Sequence[float] = (),
) -> Outcome:
    """The outcome where every row's engine gives what ``answer`` makes of the truth.

    ``true``: speeds without a truth; ``rungs``: what comes of other steps, by their factors; ``between``: times off
    the grid [s] that are sampled, too.
    """
    planned, results, runner = answered(folder, comparison, answer, true, rungs, certificate, between)
    return evaluate(planned, results, runner)


def answered(
    folder: Path,
    comparison: Comparison,
    answer: Answer,
    true: Mapping[float, Result | xr.Dataset] | None = None,
    rungs: Mapping[float, Answer] | None = None,
    certificate: Sequence[Line] = (),
    between: Sequence[float] = (),
) -> tuple[Plan, dict[str, Result], Runner]:
    """The plan, results and runner of :func:`judged`, of the same arguments."""
    store, results = Store(folder), dict[str, Result]()
    runs, truths, scenes = list[Planned](), dict[str, Case](), dict[str, Scene]()

    def put(case: Case, given: xr.Dataset | Result) -> Case:
        if isinstance(given, xr.Dataset):
            write(given, store.trajectory(case))
            lines = [line.as_dict() for line in certificate]
            given = Result(Status.DONE, "reached the end", certificate=lines, trajectory=store.trajectory(case).name)
        results[case.key] = given
        return case

    for row in comparison.rows:
        for point in comparison.variations(row):
            scene = scenes[point_name(point)] = load_scene(comparison.scene, **point)
            sampled = comparison.until, comparison.every, tuple(between)
            dataset = true_motion(comparison.scene, tuple(point.items()), *sampled).copy()
            facts = dataclasses.replace(FACTS, name=row.engine)
            given = (comparison.scene, point, scene.digest)
            truths[point_name(point)] = put(
                Case(*given, TRUTH, comparison.until, comparison.every),
                (true or {}).get(point.get("speed", 0.0), dataset),
            )
            ladder = {}
            for factor, how in {1.0: answer, **(rungs or {})}.items():
                scaled = dataclasses.replace(facts, settings={"dt": 1e-3 * factor})
                ladder[factor] = put(Case(*given, scaled, comparison.until, comparison.every), how(scene, dataset))
            runs.append(Planned(row, point, facts, ladder))
    usual, file = load_scene(comparison.scene), read_scene_file(comparison.scene)
    return Plan(comparison, usual, file, scenes, truths, runs), results, Runner(store, jobs=1)


def the_truth(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
    """An engine without error."""
    return dataset


def off(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
    """An engine whose ball is a millimetre too high."""
    return dataset.assign(z=dataset["z"] + 1e-3)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("angle", "agrees"), [(0.0, True), (1e-4, True), (0.1, False)])
def test_the_orientation_of_a_ball_is_judged(tmp_path: Path, angle: float, agrees: bool) -> None:
    """A ball that is right but for its orientation differs; a quaternion's sign, any at each sample, says nothing."""

    def turned(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
        turns = Rotation.from_quat(dataset["q_WB"].to_numpy()[:, 0], scalar_first=True)
        q = turns * Rotation.from_rotvec([0, angle, 0])
        signs = np.where(np.arange(dataset.sizes["time"]) % 3, -1.0, 1.0)[:, None]
        said = (("time", "body", "wxyz"), (signs * q.as_quat(scalar_first=True))[:, None])
        return dataset.assign(q_WB=said, attitude=said)

    (run,) = judged(tmp_path, claim([ROW], [4.0], TIGHT | {"attitude": Tolerance(1e-3, False, "1")}), turned).runs
    assert {j.observable: j.verdict is Verdict.AGREES for j in run.judgements} == {
        "gamma": True,
        "z": True,
        "attitude": agrees,
    }


@pytest.mark.drill
def test_a_claim_that_holds(tmp_path: Path) -> None:
    """An engine that gives the truth contradicts nothing, and one that is off contradicts once, by its observable."""
    assert judged(tmp_path / "right", claim([ROW], [4.0]), the_truth).contradictions == []
    (said,) = judged(tmp_path / "wrong", claim([ROW], [4.0]), off).contradictions
    assert said.startswith("alpha at speed=4 differs, expected: agrees (z differs; z: error 1e-3 m beyond 1e-9 m")


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("row", "bounds"),
    [
        (ROW, TIGHT | {"first_slip": Tolerance(1e-3, False, "s")}),
        (dataclasses.replace(ROW, bound={"first_slip": Tolerance(1e-3, False, "s")}), TIGHT),
        (dataclasses.replace(ROW, limit={"first_slip": Tolerance(1e-3, False, "s")}), TIGHT),
        (dataclasses.replace(ROW, order={"first_slip": (1.0, 2.0)}), TIGHT),
        (dataclasses.replace(ROW, expect_for={"first_slip": [Verdict.AGREES]}), TIGHT),
    ],
    ids=["tolerance", "bound", "limit", "order", "expect_for"],
)
def test_a_claim_about_what_is_not_reported(tmp_path: Path, row: Row, bounds: Mapping[str, Tolerance]) -> None:
    """A claim about an observable that the run does not give is a contradiction, wherever the claim stands."""
    (said,) = judged(tmp_path, claim([row], [4.0], bounds), the_truth).contradictions
    assert said == "alpha at speed=4: first_slip is not reported, though claim makes a claim about it"


@pytest.mark.parametrize(
    ("seen", "said"),
    [
        (
            {"order": 0.123456789, "limit_error": 1.23456789e-3},
            ["order of z is 0.123, expected 1.9 to 2.1", "error of the limit of z is 1.23e-3, expected at most 1e-3"],
        ),
        (
            {},
            [
                "order of z is not known, expected 1.9 to 2.1",
                "error of the limit of z is not known, expected at most 1e-3",
            ],
        ),
    ],
    ids=["seen", "not seen"],
)
def test_orders_and_limits_are_told_in_three_digits(seen: dict[str, float], said: list[str]) -> None:
    """Numbers of what was not expected are short, one that is not known is no number, and one point has no name."""
    row = dataclasses.replace(ROW, order={"z": (1.9, 2.1)}, limit={"z": Tolerance(1e-3, False, "m")})
    right = Judgement(
        observable="z", unit="m", error=0.0, truth_error_bar=0.0, tolerance=1e-3, scale=1.0, verdict=Verdict.AGREES,
        **seen,
    )  # fmt: skip
    found = contradictions_of(claim([row], []), Planned(row, {}, FACTS), [right], ())
    assert found == [f"alpha: {sentence}" for sentence in said]


def higher(metres: float) -> Answer:
    """An engine whose ball is so much too high."""
    return lambda _, dataset: dataset.assign(z=dataset["z"] + metres)


@pytest.mark.drill
def test_a_run_is_judged_by_its_own_ladder(tmp_path: Path) -> None:
    """An engine that hits the truth at one step only differs; where a finer step gave nothing, nothing is confirmed."""
    row = dataclasses.replace(ROW, ladder=[1.0, 0.5, 0.25])
    comparison = claim([row], [4.0], TIGHT | {"z": Tolerance(1e-3, False, "m")})
    lucky = {0.5: higher(25e-3), 0.25: higher(37.5e-3)}
    (run,) = judged(tmp_path / "lucky", comparison, the_truth, rungs=lucky).runs
    assert {item.observable: item.verdict for item in run.judgements} == {"gamma": "agrees", "z": "differs"}
    assert "another limit" in run.contradictions[0]
    crashed: dict[float, Answer] = {0.5: the_truth, 0.25: lambda *_: Result(Status.DIVERGED, "NaN")}
    (run,) = judged(tmp_path / "crashed", comparison, the_truth, rungs=crashed).runs
    assert run.verdict is Verdict.UNCONFIRMED
    assert run.contradictions[0].startswith("alpha at speed=4 unconfirmed, expected: agrees (")
    assert "no limit shown: dt 0.00025 diverged: NaN" in run.contradictions[0]  # which step is missing, and why


@pytest.mark.drill
def test_a_tolerance_that_the_engine_refuses_is_no_rung(tmp_path: Path) -> None:
    """Where a half of the tolerance is tighter than any that the engine takes, those before it are judged."""
    band = Band("round-off", {"q.pivot": Tolerance(1e-9, False, "rad")})
    row = Row("projection[formulation=dependent,integrator=dop853,rtol=4e-14]", "band", ladder=[2.0, 1.0, 0.5])
    comparison = Comparison("c", "t", "q", "pendulum", 0.1, 0.05, bands={"band": band}, rows=[row])
    (run,) = compare(comparison, Runner(Store(tmp_path), jobs=1)).runs
    assert run.verdict is Verdict.AGREES
    assert len(run.rungs) == 1


@pytest.mark.drill
def test_the_error_of_a_rung_is_that_between_its_samples_too(tmp_path: Path) -> None:
    """A coarser run that is right in its samples and a millimetre off between them has that error in the ladder."""

    def hidden(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
        return dataset.assign({"between.z": dataset["between.z"] + 1e-3})

    row, rungs = dataclasses.replace(ROW, ladder=[4.0, 2.0, 1.0]), {4.0: hidden, 2.0: the_truth}
    (run,) = judged(tmp_path, claim([row], [4.0]), the_truth, rungs=rungs, between=[0.05, 0.15]).runs
    assert {rung.value: rung.errors["z"] for rung in run.rungs} == {4e-3: pytest.approx(1e-3), 2e-3: 0.0}


def silent(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
    """An engine that cannot say forces."""
    return dataset.drop_vars(["N", "F2", "F3", "needed_friction"])


@pytest.mark.drill
def test_a_silent_engine_does_not_plainly_agree(tmp_path: Path) -> None:
    """Without forces that the tolerances judge a run is incomplete, and contradicts unless that is expected."""
    bounds = TIGHT | {"N": Tolerance(1e-6, False, "N")}
    (run,) = judged(tmp_path / "silent", claim([ROW], [4.0], bounds), silent).runs
    assert (run.verdict, run.missing) == (Verdict.INCOMPLETE, ["N"])
    assert run.contradictions == ["alpha at speed=4: N is not reported, though claim makes a claim about it"]
    expected = dataclasses.replace(ROW, expect=[Verdict.INCOMPLETE])
    assert judged(tmp_path / "expected", claim([expected], [4.0], bounds), silent).contradictions == []

    def both_wrong(scene: Scene, dataset: xr.Dataset) -> xr.Dataset:
        return silent(scene, dataset.assign(z=dataset["z"] + 1e-3))

    both = judged(tmp_path / "wrong", claim([expected], [4.0], bounds), both_wrong)
    assert both.runs[0].verdict is Verdict.DIFFERS
    assert len(both.contradictions) == 1
    full = judged(tmp_path / "full", claim([expected], [4.0], bounds), the_truth)
    assert full.contradictions[0].startswith("alpha at speed=4 agrees, expected: incomplete")


@pytest.mark.drill
def test_who_shares_a_route_with_the_truth_is_marked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run of an engine that declares the truth's own equations is marked; one of an engine that does not is not."""
    (run,) = judged(tmp_path / "other", claim([ROW], [4.0]), the_truth).runs
    assert run.shared == ""
    monkeypatch.setattr(f"{__name__}.FACTS", dataclasses.replace(FACTS, shares=["closed form"]))
    (run,) = judged(tmp_path / "same", claim([ROW], [4.0]), the_truth).runs
    assert run.shared.startswith("rests on the same equations as the truth itself (closed form")


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("expect", [Verdict.AGREES, Verdict.CONVERGES, Verdict.DIFFERS])
def test_a_tolerance_below_the_truth_contradicts_nobody(tmp_path: Path, expect: Verdict) -> None:
    """Where the truth is known less well than the tolerance no run agrees, and none contradicts, right or wrong."""
    bounds = {"z": Tolerance(1e-30, False, "m")}
    row = dataclasses.replace(ROW, expect=[expect])
    for name, answer in {"right": the_truth, "wrong": off}.items():
        (run,) = judged(tmp_path / name, claim([row], [4.0], bounds), answer).runs
        assert (run.verdict, run.contradictions) == (Verdict.NOT_JUDGED, [])


def test_what_cannot_be_judged_hides_nothing(tmp_path: Path) -> None:
    """Beside an observable that nobody is judged by, another one that differs contradicts as ever."""
    bounds = TIGHT | {"gamma": Tolerance(1e-30, False, "rad")}
    (run,) = judged(tmp_path, claim([ROW], [4.0], bounds), off).runs
    assert {item.observable: item.verdict for item in run.judgements} == {"gamma": "not-judged", "z": "differs"}
    assert run.contradictions[0].startswith("alpha at speed=4 differs, expected: agrees (z differs")


@pytest.mark.drill
def test_another_scene_is_shown_and_not_judged(tmp_path: Path) -> None:
    """A friction of 1 where the unbounded scene needs 1.08 is no verdict, and contradicts only who says it agrees."""
    number = Line("inverse friction", "1", (0.0,), (1.0,), 1.0, 1.0, "the engine needs a number")
    agrees = judged(tmp_path / "a", claim([ROW], [1.2, 4.0]), the_truth, certificate=[number])
    slow, fast = agrees.runs
    assert slow.result.status is Status.ANOTHER_SCENE
    assert slow.result.message.startswith("another scene: a friction of 1, where the scene has no bound and needs 1.08")
    assert slow.result.trajectory is not None
    assert slow.judgements == []
    assert fast.verdict is Verdict.AGREES
    assert agrees.contradictions == [f"alpha at speed=1.2: {slow.result.message}"]
    row = dataclasses.replace(ROW, except_at=[ExceptAt({"speed": [1.2]}, [Verdict.DIFFERS])])
    assert judged(tmp_path / "b", claim([row], [1.2, 4.0]), the_truth, certificate=[number]).contradictions == []


@pytest.mark.drill
def test_exceptions_decide(tmp_path: Path) -> None:
    """At the point of an exception its verdict is expected and no other, elsewhere the row's."""
    differs = ExceptAt({"speed": [4.0]}, [Verdict.DIFFERS])
    row = dataclasses.replace(ROW, except_at=[differs])
    right = judged(tmp_path / "right", claim([row], [3.0, 4.0]), the_truth)
    wrong = judged(tmp_path / "wrong", claim([row], [3.0, 4.0]), off)
    assert [said.partition(" (")[0] for said in right.contradictions] == ["alpha at speed=4 agrees, expected: differs"]
    assert [said.partition(" (")[0] for said in wrong.contradictions] == ["alpha at speed=3 differs, expected: agrees"]


@pytest.mark.drill
def test_an_exception_may_expect_a_failure(tmp_path: Path) -> None:
    """A run that is expected to fail is neither lost nor a contradiction; the same elsewhere is both."""

    def crash(*_: object) -> Result:
        return Result(Status.CRASHED, "no licence")

    row = dataclasses.replace(ROW, except_at=[ExceptAt({"speed": [4.0]}, [Verdict.FAILED])])
    outcome = judged(tmp_path, claim([row], [3.0, 4.0]), crash)
    assert outcome.contradictions == ["alpha at speed=3 crashed, expected: agrees (no licence)"]
    assert [run.parameters for run in outcome.lost] == [{"speed": 3.0}]
    assert [run.verdict for run in outcome.runs] == [Verdict.FAILED] * 2


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("status", "verdict"), [(Status.REFUSED, Verdict.REFUSED), (Status.WRONG_MODEL, Verdict.FAILED)]
)
def test_a_refusal_is_no_failure(tmp_path: Path, status: Status, verdict: Verdict) -> None:
    """An engine that refuses has not failed, one that built something else has; either contradicts what it is not."""

    def answer(*_: object) -> Result:
        return Result(status, "one coefficient only")

    for expected in (Verdict.AGREES, Verdict.REFUSED, Verdict.FAILED):
        row = dataclasses.replace(ROW, expect=[expected])
        outcome = judged(tmp_path / expected, claim([row], [4.0]), answer)
        assert [run.verdict for run in outcome.runs] == [verdict]
        said = f"alpha at speed=4 {status}, expected: {expected} (one coefficient only)"
        assert outcome.contradictions == ([] if expected is verdict else [said])
        assert outcome.lost == []
        assert exit_code([outcome]) == (0 if expected is verdict else 1)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("status", [Status.DIVERGED, Status.WRONG_MODEL, Status.CRASHED, Status.REFUSED])
@pytest.mark.parametrize("true", [True, False])
def test_a_failure_counts_where_nothing_is_claimed(tmp_path: Path, status: Status, true: bool) -> None:
    """A first look exits 3 where an engine failed or all refused, truth or not; one refusal is no failure."""

    def answer(*_: object) -> Result:
        return Result(status, "the step fell to nothing")

    free = [dataclasses.replace(ROW, engine=engine, expect=list(Verdict)) for engine in ("alpha", "beta")]
    none = {} if true else {4.0: Result(Status.REFUSED, "two feet touch at once")}
    outcome = judged(tmp_path, claim(free, [4.0]), answer, none)
    assert exit_code([outcome]) == 3
    right = judged(tmp_path / "right", claim(free[:1], [4.0]), the_truth)
    beside = dataclasses.replace(right, runs=[*right.runs, *outcome.runs])
    assert exit_code([beside]) == (0 if status is Status.REFUSED else 3)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("witness", "engine", "code"), [(True, True, 0), (True, False, 3), (False, True, 3)])
def test_a_witness_that_fails_fails_no_comparison(tmp_path: Path, witness: bool, engine: bool, code: int) -> None:
    """What cross-checks the truth, and fails, costs an exit code only where nothing else is compared."""
    free = dataclasses.replace(ROW, expect=list(Verdict))
    comparison = claim([free], [4.0])
    failed = judged(tmp_path / "w", comparison, lambda *_: Result(Status.DIVERGED, "the step fell to nothing")).runs
    facts = dataclasses.replace(FACTS, witness=witness)
    runs = [dataclasses.replace(run, facts=facts) for run in failed]
    whole = judged(tmp_path / "e", comparison, the_truth)
    outcome = dataclasses.replace(whole, runs=[*(whole.runs if engine else []), *runs])
    assert exit_code([outcome]) == code


@pytest.mark.drill
def test_reactions_without_a_tolerance_are_named(tmp_path: Path) -> None:
    """A first look says which forces and moments it does not judge; a comparison file states what it judges."""
    free = dataclasses.replace(ROW, tolerance="fall", expect=list(Verdict))
    bands = {"fall": Band("", {"positions": Tolerance(1e-9, False, "m")})}
    compared = Comparison("fall", "", "", "gear_pair", 0.1, 0.05, bands=bands, rows=[free], budget=60.0)
    outcome = judged(tmp_path, compared, the_truth)
    assert {"forces", "torques", "coupling.*"} <= set(outcome_content(outcome).unjudged)
    claimed = dataclasses.replace(outcome, comparison=dataclasses.replace(compared, asked="fall.toml"))
    assert outcome_content(claimed).unjudged == []


@pytest.mark.drill
def test_a_time_that_is_cut_before_anything_touches_is_no_success(tmp_path: Path) -> None:
    """Bodies that fall and touch nothing in what is left of the time: said, and exit 3; whole, or touched: exit 0."""
    free = dataclasses.replace(ROW, tolerance="fall", expect=list(Verdict))
    fall = Band("", {"positions": Tolerance(1e-9, False, "m")})
    codes = {}
    for until in (0.1, 0.6):
        compared = Comparison("fall", "", "", "spinning_bounce", until, until / 4, bands={"fall": fall}, rows=[free])
        outcome = judged(tmp_path / f"{until}", compared, the_truth)
        cut = dataclasses.replace(outcome, comparison=dataclasses.replace(compared, cut=True))
        codes[until] = exit_code([outcome]), exit_code([cut]), cut.no_contact.partition(":")[0]
    assert codes == {0.1: (0, 3, "No contact was reached"), 0.6: (0, 0, "")}


@pytest.mark.parametrize("status", [Status.REFUSED, Status.LEFT_OUT])
def test_a_comparison_that_judges_nothing_is_no_success(tmp_path: Path, status: Status) -> None:
    """A first look without a truth exits 3, also if every engine ran; one that expects it exits 0."""
    none = {4.0: Result(status, "two feet touch at once")}
    free = dataclasses.replace(ROW, expect=list(Verdict))
    assert exit_code([judged(tmp_path / "free", claim([free], [4.0]), the_truth, none)]) == 3
    expected = dataclasses.replace(ROW, expect=[Verdict.NOT_JUDGED])
    assert exit_code([judged(tmp_path / "claim", claim([expected], [4.0]), the_truth, none)]) == 0


def test_a_failure_that_was_expected_and_does_not_come(tmp_path: Path) -> None:
    """An engine that runs where a failure is expected contradicts the claim."""
    row = dataclasses.replace(ROW, expect=[Verdict.FAILED])
    (said,) = judged(tmp_path, claim([row], [4.0]), the_truth).contradictions
    assert said.startswith("alpha at speed=4 agrees, expected: failed")


@pytest.mark.nightly
def test_at_a_stair_edge_nobody_is_judged_by_the_time_of_slip(tmp_path: Path) -> None:
    """At a stair edge what hangs on the time of slip is ill-posed, agreement included; energy and gap are judged."""
    bounds = {
        "z": Tolerance(0.005, True),
        "first_slip": Tolerance(2e-3, False, "s"),
        "event_times": Tolerance(5e-3, False, "s"),
        "event_order": Tolerance(0.5, False, "events"),
        "energy_balance": Tolerance(0.01, True),
        "gap": Tolerance(1e-5, False, "m"),
    }
    edge = {"speed": 4.0, "rolling_resistance": 5e-4, "mu_static": 0.391459}
    engine = "pinocchio[formulation=impulses,preset=tuned]"
    base = claim([dataclasses.replace(ROW, engine="pinocchio")], [], bounds)
    comparison = dataclasses.replace(base, vary={}, points=[edge], until=2.0)

    def projection(scene: Scene, _: xr.Dataset) -> xr.Dataset:
        return simulate(scene, engine, until=2.0, every=0.02)

    (run,) = judged(tmp_path / "right", comparison, projection).runs
    verdicts = {judgement.observable: judgement.verdict for judgement in run.judgements}
    hanging = dict.fromkeys(("z", "first_slip", "event_order", "event_times"), Verdict.ILL_POSED)
    assert verdicts == hanging | dict.fromkeys(("energy_balance", "gap"), Verdict.AGREES)
    assert (run.verdict, run.contradictions) == (Verdict.ILL_POSED, [])


@pytest.mark.drill
@pytest.mark.nightly_of("0.0001")
@pytest.mark.parametrize("tolerance", [1e-4, 2e-3])
def test_events_that_are_late_alike_in_every_run_are_no_other_limit(tmp_path: Path, tolerance: float) -> None:
    """An event that ends with the same step on each rung of a ladder is known to that step, within tolerance or not."""
    row = dataclasses.replace(ROW, ladder=[2.0, 1.0, 0.5])
    base = claim([row], [], {"first_slip": Tolerance(tolerance, False, "s")})
    slipping = {"speed": 4.0, "mu_static": 0.15}
    comparison = dataclasses.replace(base, vary={}, points=[slipping], until=1.0)

    def late(factor: float) -> Answer:
        def answer(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
            ends = dataset["event_time"] + 3e-4
            return dataset.assign(event_time=ends, event_low=ends - 1e-3 * factor, event_high=ends)

        return answer

    (run,) = judged(tmp_path, comparison, late(1.0), rungs={factor: late(factor) for factor in (2.0, 0.5)}).runs
    (found,) = run.judgements
    assert found.error == pytest.approx(3e-4)
    assert found.limit is not LimitResult.ANOTHER
    assert not found.remarks


@pytest.mark.drill
def test_what_holds_on_every_path_is_judged_at_a_stair_edge(tmp_path: Path) -> None:
    """At a stair edge a wrong path is not judged, but energy from nowhere and a ball off the wall are."""
    bounds = {"z": Tolerance(1e-9, False, "m"), "energy_balance": Tolerance(1e-3, True)}
    edge = {"speed": 4.0, "rolling_resistance": 5e-4, "mu_static": 0.391459}
    base = claim([ROW], [], bounds | {"gap": Tolerance(1e-6, False, "m")})
    comparison = dataclasses.replace(base, vary={}, points=[edge], until=2.0)

    def wrong(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
        late = (dataset["time"] > 1.0) * 1e-2
        return dataset.assign(
            z=dataset["z"] + late, energy=dataset["energy"] * (1 + late), gap=dataset["gap"] + 1e-2 * late
        )

    (run,) = judged(tmp_path, comparison, wrong).runs
    verdicts = {judgement.observable: judgement.verdict for judgement in run.judgements}
    assert verdicts == {"z": Verdict.ILL_POSED, "energy_balance": Verdict.DIFFERS, "gap": Verdict.DIFFERS}
    (said,) = run.contradictions
    assert "differs, expected: agrees" in said


@pytest.mark.nightly
def test_neighbouring_points_have_truths_of_their_own(
    tmp_path: Path, install_engines: Callable[[Mapping[str, str]], None]
) -> None:
    """Points that differ in the seventh digit are judged each against its own truth."""
    install_engines(ENTRY_POINTS)
    speeds = [4.0, 4.000001]
    comparison = claim([dataclasses.replace(ROW, engine="oracle")], speeds)
    outcome = compare(comparison, Runner(Store(tmp_path), jobs=1))
    assert [run.parameters["speed"] for run in outcome.runs] == speeds
    assert len({point.case.key for point in outcome.points.values()}) == 2
    assert [run.verdict for run in outcome.runs] == [Verdict.AGREES] * 2
    # The other point's truth is further away than the tolerance.
    assert 1e-6 / 0.2 * comparison.until > TIGHT["gamma"].absolute(1.0)


@pytest.mark.drill
def test_a_point_where_the_truth_refuses(tmp_path: Path) -> None:
    """Where the truth refuses nobody is judged, with its reason; an engine that failed there failed all the same."""
    rows = [ROW, dataclasses.replace(ROW, engine="beta")]
    none = {4.0: Result(Status.REFUSED, "the ball is back on the wall")}
    outcome = judged(tmp_path, claim(rows, [3.0, 4.0]), the_truth, none)
    there = [run for run in outcome.runs if run.parameters["speed"] == 4.0]
    assert outcome.contradictions == []
    for run in there:
        assert (run.verdict, run.judgements, run.missing) == (Verdict.NOT_JUDGED, [], [])
        assert run.result.message == "the ball is back on the wall"
        assert run.result.trajectory is not None
    content = outcome_content(outcome)
    assert [row.verdict for row in content.rows] == ["agrees", "agrees"]
    assert [row.verdicts["not-judged"] for row in content.rows] == [1, 1]
    assert content.runs[1].reason.startswith("no truth at speed=4: the ball")


@pytest.mark.drill
def test_where_no_motion_is_unique_tolerances_of_motion_judge_nobody(tmp_path: Path) -> None:
    """Where the truth knows laws alone, a row whose tolerances name no law is not judged, for that reason."""
    bounds = {"positions": Tolerance(1e-3, False, "m")}
    comparison = dataclasses.replace(claim([ROW], [], bounds), scene="painleve_rod", vary={})

    def moved(_: Scene, laws: xr.Dataset) -> xr.Dataset:
        return laws.assign({name: item.fillna(0.0) for name, item in laws.items() if item.dtype.kind == "f"})

    outcome = judged(tmp_path, comparison, moved)
    assert outcome.contradictions == []
    assert [(run.verdict, run.judgements) for run in outcome.runs] == [(Verdict.NOT_JUDGED, [])]
    assert "no motion is unique here, and no law has a tolerance: " in outcome.runs[0].result.message


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("status", "clause"), [(Status.CRASHED, "the truth ended in an error"), (Status.TIMEOUT, "the truth took too long")]
)
def test_a_point_where_the_truth_is_lost(tmp_path: Path, status: Status, clause: str) -> None:
    """Where the truth crashed or hung no engine is judged or accused, the exit code is 3; other points are judged."""
    rows = [ROW, dataclasses.replace(ROW, engine="beta")]
    none = {4.0: Result(status, "the ball is back on the wall")}
    outcome = judged(tmp_path, claim(rows, [3.0, 4.0, 5.0]), the_truth, none)
    verdicts = {(run.row.engine, run.parameters["speed"]): run.verdict for run in outcome.runs}
    assert verdicts == {
        (engine, speed): Verdict.NOT_JUDGED if speed == 4.0 else Verdict.AGREES
        for engine in ("alpha", "beta")
        for speed in (3.0, 4.0, 5.0)
    }
    assert outcome.contradictions == []
    assert {run.result.message for run in outcome.lost} == {f"{clause}: the ball is back on the wall"}
    assert len(outcome.lost) == 2
    assert exit_code([outcome]) == 3


@pytest.mark.parametrize("steps", [True, False])
def test_a_row_whose_steps_gave_no_reference_says_why(tmp_path: Path, steps: bool) -> None:
    """Its steps are called the reference where there is one; where they ended, the row has the reason as others do."""
    ended = Result(Status.DIVERGED, "the steps of alpha end: they do not settle")
    planned, results, runner = answered(tmp_path, claim([ROW], [4.0]), the_truth, {} if steps else {4.0: ended})
    planned = dataclasses.replace(planned, runs=[dataclasses.replace(run, ladder={}) for run in planned.runs])
    (run,) = evaluate(planned, results, runner).runs
    assert run.verdict is Verdict.NOT_JUDGED
    words = "its steps are the reference, which is no judge of itself"
    assert run.result.message == (words if steps else ended.message)


@pytest.mark.parametrize(("longest", "until"), [(1.0, 0.4), (0.1, 0.05), (0.001, 0.4)])
def test_a_budget_buys_the_time_that_a_truth_ends_in(longest: float, until: float) -> None:
    """A truth that does not end in a part of the budget is asked for a shorter time; without one no engine is run."""
    comparison = dataclasses.replace(claim([ROW], [4.0]), until=0.4, every=0.01, budget=60.0)
    usual, file = load_scene(comparison.scene), read_scene_file(comparison.scene)
    given = (comparison.scene, {}, usual.digest)
    case, run = (Case(*given, facts, comparison.until, comparison.every) for facts in (TRUTH, FACTS))
    asked = Plan(comparison, usual, file, {"": usual}, {"": case}, [Planned(ROW, {}, FACTS, {1.0: run})])

    class Answering:
        def run(self, cases: Sequence[Case], budget: TimeBudget) -> dict[str, Result]:
            assert budget.left <= 0.8 * 60
            done = Result(Status.DONE, "")
            return {case.key: done if case.until <= longest else LEFT_OUT for case in cases}

    found = affordable(asked, Answering())  # type: ignore[arg-type]
    assert found.comparison.until == pytest.approx(until)
    assert {case.until for case in found.cases} == {found.comparison.until}
    assert (found.comparison.spent >= 60.0) is (longest < 0.01)
    assert ("(the first 0.05 s, for which the budget suffices)" in found.comparison.title) is (until == 0.05)


@pytest.mark.parametrize("status", [Status.DIVERGED, Status.REFUSED, Status.DONE])
def test_the_other_steps_of_a_lost_row_are_not_run(status: Status) -> None:
    """Where a row's own step has no result, no other step of it is run, but for those that another row needs."""
    comparison = dataclasses.replace(claim([ROW], [4.0]), budget=60.0)
    usual, file = load_scene(comparison.scene), read_scene_file(comparison.scene)
    given = (comparison.scene, {}, usual.digest)

    def case(dt: float) -> Case:
        return Case(*given, dataclasses.replace(FACTS, settings={"dt": dt}), comparison.until, comparison.every)

    fine, coarse = ({1.0: case(dt), 2.0: case(2 * dt), 4.0: case(4 * dt)} for dt in (1e-3, 2e-3))
    rows = [Planned(ROW, {}, FACTS, ladder) for ladder in (fine, coarse)]
    asked = Plan(comparison, usual, file, {"": usual}, {"": Case(*given, TRUTH, 0.4, 0.02)}, rows)
    ran: list[str] = []

    class Answering:
        def run(self, cases: Sequence[Case], *_: object) -> dict[str, Result]:
            ran.extend(case.key for case in cases)
            return {case.key: Result(status if case.key == fine[1.0].key else Status.DONE, "so") for case in cases}

    told: dict[str, Result] = {}
    results = run_within_budget(asked, Answering(), lambda case, result: told.update({case.key: result}))  # type: ignore[arg-type]
    assert results.keys() == {case.key for case in asked.cases}
    assert set(ran) == results.keys(), "the finer row shares its other steps with the coarser one"
    alone = dataclasses.replace(asked, runs=rows[:1])
    ran.clear()
    results = run_within_budget(alone, Answering(), lambda case, result: told.update({case.key: result}))  # type: ignore[arg-type]
    assert results.keys() == {case.key for case in alone.cases}
    others = {fine[2.0].key, fine[4.0].key}
    assert set(ran) & others == (others if status is Status.DONE else set())
    if status is not Status.DONE:
        assert all(results[key] is told[key] for key in others)
        assert {results[key].status for key in others} == {Status.NOT_RUN}


CLAIMS = {
    "agrees": {},
    "any": {"expect": list(Verdict), "because": "a look"},
    "order": {"order": {"z": (1.8, 2.2)}},
    "unconfirmed": {"expect": [Verdict.UNCONFIRMED], "because": "its limit is another"},
}


@pytest.mark.drill_of("0.5-2-0.0-agrees", "0.5-2-0.0-unconfirmed")
@pytest.mark.parametrize("claimed", CLAIMS)
@pytest.mark.parametrize("beside", [0.0, 0.3, 0.9, 5.0])
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("error", [0.0, 0.5, 20.0])
def test_spare_steps_make_no_verdict_worse(
    error: float, order: int, beside: float, claimed: str, tmp_path: Path
) -> None:
    """Steps that are left out where the own one agrees change no other verdict and bring no contradiction.

    ``error``: of the own step, ``beside``: of the limit of small steps, as parts of the tolerance.
    """

    def by_step(factor: float) -> Answer:
        def answer(_: Scene, dataset: xr.Dataset) -> xr.Dataset:
            shape = np.sin(np.linspace(0.0, 3.0, dataset.sizes["time"]))
            return dataset.assign(z=dataset["z"] + 1e-3 * shape * (beside + error * factor**order))

        return answer

    row = dataclasses.replace(ROW, ladder=[4.0, 2.0, 1.0], **CLAIMS[claimed])
    comparison = claim([row], [4.0], {"z": Tolerance(1e-3, False, "m")})
    rungs = {factor: by_step(factor) for factor in (4.0, 2.0)}
    planned, results, runner = answered(tmp_path, comparison, by_step(1.0), rungs=rungs)
    whole = evaluate(planned, results, runner)
    ran: list[str] = []

    class Answering:
        store = runner.store

        def run(self, cases: Sequence[Case], _: object) -> dict[str, Result]:
            ran.extend(case.key for case in cases)
            return {case.key: results[case.key] for case in cases}

    spare = dataclasses.replace(planned, runs=[dataclasses.replace(run, spare=True) for run in planned.runs])
    (kept,), partly = run_plans([spare], Answering())  # type: ignore[arg-type]
    assert len(ran) == len(set(ran)) == len(partly)
    outcome = evaluate(kept, partly, runner)
    (now,), (before,) = outcome.runs, whole.runs
    if ran == [case.key for case in planned.cases]:
        assert outcome == dataclasses.replace(whole, points=outcome.points)
    else:
        assert now.verdict is Verdict.AGREES
        assert not now.contradictions
        assert all(judgement.limit is LimitResult.NO_LADDER for judgement in now.judgements)
    if error + beside > 1 or claimed in {"order", "unconfirmed"}:
        assert (now.verdict, now.contradictions) == (before.verdict, before.contradictions)


LEFT_OUT = Result(Status.LEFT_OUT, "the 60 s of processor time did not suffice")
EXPECTED = {"agrees": [Verdict.AGREES], "converges": [Verdict.CONVERGES], "failed": [Verdict.FAILED]}


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("given", "said"),
    [
        (Result(Status.CRASHED, "no licence"), {"agrees": "crashed", "converges": "crashed"}),
        (LEFT_OUT, {}),
        (None, {"converges": "unconfirmed", "failed": "unconfirmed"}),
        (1e-3, {"agrees": "differs", "failed": "differs"}),
    ],
    ids=["crashed", "left out", "right", "off"],
)
def test_what_a_budget_left_out_hides_no_contradiction(
    tmp_path: Path, given: Result | float | None, said: Mapping[str, str]
) -> None:
    """A row without its finest run contradicts by what no finer run can change: failure, or error at its step."""
    for name, expected in EXPECTED.items():
        row = dataclasses.replace(ROW, ladder=[1.0, 0.5, 0.25], expect=expected)
        answer: Answer = (lambda *_: given) if isinstance(given, Result) else higher(given or 0.0)
        rungs: dict[float, Answer] = {0.5: answer, 0.25: lambda *_: LEFT_OUT}
        found = judged(tmp_path / name, claim([row], [4.0]), answer, rungs=rungs).contradictions
        heads = [f"alpha at speed=4 {said[name]}, expected: {name}"] if name in said else []
        assert [sentence.partition(" (")[0] for sentence in found] == heads
