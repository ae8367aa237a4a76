"""Sweeps over steps and tolerances, on real engines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from proofroll.core.dataset import BETWEEN
from proofroll.core.errors import InputError
from proofroll.core.time_grid import off_grid, time_grid
from proofroll.core.truth import truth
from proofroll.running.case import Case, Result, Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.running.time_budget import TimeBudget
from proofroll.studies.tradeoff import tradeoff
from proofroll.studies.tradeoff.curve import Curve, CurvePoint, Question
from proofroll.studies.tradeoff.sweep import BROKEN, FINER, _affordable, _first, _further, curves_of, sweep, too_long
from proofroll.studies.tradeoff.tradeoff import _briefly

QUESTION = Question("sphere_in_cylinder", {"speed": 3.0}, 0.1, "z")


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Curve], float]:
    """Curves over steps and over tolerances, and the range of z."""
    curves, absent = curves_of(
        [
            "projection[formulation=rotating_frame,preset=default]",
            "projection[formulation=rotating_frame,preset=matched]",
        ]
    )
    assert absent == {}
    references = sweep(QUESTION, curves, Runner(Store(tmp_path_factory.mktemp("cases")), jobs=1))
    return {curve.engine: curve for curve in curves}, references[QUESTION.every].sizes["z"]


@pytest.mark.drill
def test_a_curve_over_steps_begins_where_it_breaks(swept: tuple[dict[str, Curve], float]) -> None:
    """The coarsest step is extended until the run is broken, the finest while the error still falls."""
    curves, scale = swept
    points = curves["projection[formulation=rotating_frame,preset=default]"].points
    assert len(points) >= 6
    first = points[0]
    assert first.step is not None
    broken = first.result.status != Status.DONE or first.errors["z"] >= BROKEN * scale
    assert broken or first.step == 8 * QUESTION.every
    assert points[-1].errors["z"] < 1e-4 * scale


@pytest.mark.drill
def test_a_curve_over_tolerances(swept: tuple[dict[str, Curve], float]) -> None:
    """An adaptive formulation is swept over tolerances down to the preset's own."""
    curve = swept[0]["projection[formulation=rotating_frame,preset=matched]"]
    assert not curve.fixed_step
    steps = [point.step for point in curve.points]
    assert steps[-1] == curve.facts.settings["rtol"]
    assert max(steps) >= 1e-2
    assert curve.points[0].dense.keys() >= {"z", "gamma", "N"}


@pytest.mark.drill
def test_a_curve_over_tolerances_begins_where_it_breaks(swept: tuple[dict[str, Curve], float]) -> None:
    """Tolerances are loosened until the run is broken, or until something else limits its steps; no clock has a say."""
    curves, scale = swept
    curve = curves["projection[formulation=rotating_frame,preset=matched]"]
    first = curve.points[0]
    broken = first.result.status != Status.DONE or first.errors["z"] >= BROKEN * scale
    assert broken or curve.saturated("z")
    assert first.step is not None
    assert first.step >= 1e-1


def test_round_off_does_not_make_another_run_of_the_same_one() -> None:
    """Two errors that differ in their last digits are those of one run; two that differ by a part of them are not."""
    (curve,), _ = curves_of(["projection[formulation=rotating_frame,preset=matched]"])

    def point(error: float) -> CurvePoint:
        result = Result(Status.DONE, "reached 1 s")
        return CurvePoint(None, result, errors={"z": error}, bars={"z": 1e-15})  # type: ignore[arg-type]  # no case is run

    for first, second, same in ((7.2e-16, 1.05e-15, True), (2.84893454e-7, 2.84893458e-7, True), (3e-2, 4e-3, False)):
        curve.points = [point(first), point(second)]
        assert curve.saturated("z") is same


@pytest.mark.drill
def test_a_tolerance_that_holds_only_between_many_samples_does_not_hold(
    swept: tuple[dict[str, Curve], float],
) -> None:
    """Where a step ends at each of many samples, a loose tolerance looks as good as a tight one; with few it is not."""
    points = swept[0]["projection[formulation=rotating_frame,preset=matched]"].points
    loose = next(point for point in points if point.step == 1e-2)
    assert loose.dense["z"] < 1e-12
    assert loose.errors["z"] > 1e4 * loose.dense["z"]
    assert loose.sparse is not None
    assert loose.errors["z"] == loose.sparse.errors["z"]
    assert loose.sparse.case.every == QUESTION.until / 2
    fixed = swept[0]["projection[formulation=rotating_frame,preset=default]"].points
    assert all(point.sparse is None for point in fixed)


def test_how_far_a_curve_goes_does_not_hang_on_how_fast_the_machine_is() -> None:
    """Runs that seem to have taken a thousand times as long are followed by the same finer steps."""
    (curve,), _ = curves_of(["projection[formulation=rotating_frame,preset=default]"])

    def point(step: float, error: float, seconds: float) -> CurvePoint:
        facts = replace(curve.facts, settings=curve.facts.settings | {"dt": step})
        case = Case("sphere_in_cylinder", {}, "", facts, QUESTION.until, QUESTION.every)
        return CurvePoint(case, Result(Status.DONE, "reached", wall_seconds=seconds), errors={"z": error})

    reference = SimpleNamespace(scale=lambda _: 1.0, magnitude=lambda _: 1.0)
    found = []
    for slowness in (1.0, 1e3):
        curve.points = [point(2e-4, 4e-4, slowness), point(1e-4, 1e-4, 2 * slowness)]
        found.append(_further(QUESTION, curve, {QUESTION.every: reference}))  # type: ignore[dict-item]
    assert found[0] == found[1] != []


def test_a_brief_study_follows_furthest_what_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The curve that a claim names has a finer step than the others; none has the finest."""
    monkeypatch.setattr(tradeoff, "FINER", FINER)
    curves, _ = curves_of(["projection[formulation=rotating_frame,preset=default]", "reduced[formulation=equations]"])
    found = {curve.facts.name: _briefly(["projection[preset=default]"], curve) for curve in curves}
    assert found == {"projection": [*FINER[:2]], "reduced": [*FINER[:1]]}


@pytest.mark.parametrize(("bar", "error"), [(1e-6, 5e-7), (1e-15, 2e-13)])
def test_a_curve_ends_where_the_truth_or_round_off_shows_no_more(bar: float, error: float) -> None:
    """An error below the truth's bar, or of the size of round-off, is followed by no finer step."""
    (curve,), _ = curves_of(["projection[formulation=rotating_frame,preset=default]"])

    def point(step: float, error: float) -> CurvePoint:
        facts = replace(curve.facts, settings=curve.facts.settings | {"dt": step})
        case = Case("sphere_in_cylinder", {}, "", facts, QUESTION.until, QUESTION.every)
        return CurvePoint(case, Result(Status.DONE, "reached"), errors={"z": error}, bars={"z": bar})

    reference, found = SimpleNamespace(scale=lambda _: 1.0, magnitude=lambda _: 1.0), []
    for last in (error, 100 * error):
        curve.points = [point(8 * QUESTION.every, 1.0), point(2e-4, 1600 * error), point(1e-4, last)]
        found.append(_further(QUESTION, curve, {QUESTION.every: reference}))  # type: ignore[dict-item]
    assert found == [[], [QUESTION.step(1 / 500)]]


@pytest.mark.drill
def test_the_truth_is_known_wherever_a_run_is_sampled(swept: tuple[dict[str, Curve], float]) -> None:
    """Samples that engines have off the grid have their true values, and no other sampling interval has any."""
    cases = [point.case for curve in swept[0].values() for point in curve.points]
    truth = QUESTION.truth(cases[0].engine, cases)
    assert truth.between
    for case in cases:
        off = off_grid(time_grid(case.until, case.every), case.engine.step)
        assert set(off) <= (set(truth.between) if case.every == QUESTION.every else set())


def test_a_curve_has_each_tolerance_once() -> None:
    """An engine's own tolerance that is among those of every curve is no second point."""
    (curve,), _ = curves_of(["projection[formulation=rotating_frame,preset=matched,rtol=1e-8]"])
    assert curve.facts.settings["rtol"] in (tolerances := _first(QUESTION, curve))
    assert len(set(tolerances)) == len(tolerances)


@pytest.mark.drill
def test_nothing_of_a_curve_is_lost(swept: tuple[dict[str, Curve], float]) -> None:
    """Every point has a result, and those that reached the end have an error for every observable."""
    for curve in swept[0].values():
        for point in curve.points:
            assert point.result.message
            if point.result.status == Status.DONE:
                assert {"gamma", "z", "N", "F2", "F3", "gap", "slip"} <= point.errors.keys()


def test_engines_that_do_not_exist() -> None:
    """An unknown engine, formulation or setting is an error that names it."""
    for text in ("adams", "exudyn[formulation=none]", "exudyn[wheels=4]"):
        with pytest.raises(InputError):
            curves_of([text])


@pytest.mark.parametrize(("step", "left", "affordable"), [(1e-3, 8.1, True), (1e-3, 7.9, False), (4e-3, 2.1, True)])
def test_within_a_budget_a_step_takes_no_more_than_its_share(step: float, left: float, affordable: bool) -> None:
    """Of two curves each may take a quarter of what is left, as the step before foretells; what may not is dropped."""
    (curve,), _ = curves_of(["projection[formulation=rotating_frame,preset=default]"])

    def case(step: float) -> Case:
        facts = replace(curve.facts, settings=curve.facts.settings | {"dt": step})
        return Case("sphere_in_cylinder", {}, "", facts, QUESTION.until, QUESTION.every)

    curve.points = [CurvePoint(case(2e-3), Result(Status.DONE, "reached", processor={"advance": 1.0}))]
    budget = SimpleNamespace(left=left, sentence="too dear")
    assert _affordable(curve, case(step), budget, None, 2) is affordable  # type: ignore[arg-type]
    assert curve.dropped == ({} if affordable else {step: "too dear"})
    too_coarse = Result(Status.REFUSED, "its contact is too soft for this step", processor={})
    curve.points, curve.dropped = [CurvePoint(case(2e-3), too_coarse)], {}
    assert _affordable(curve, case(step), budget, None, 2)  # type: ignore[arg-type]


@pytest.mark.parametrize(("longest", "kept"), [(1.9, False), (2.1, True), (None, True)])
def test_a_run_that_would_take_too_long_is_dropped(longest: float | None, kept: bool) -> None:
    """Half the step takes twice as long: a brief study drops it above its longest run, and says so."""
    (curve,), _ = curves_of(["projection[formulation=rotating_frame,preset=default]"])

    def case(step: float) -> Case:
        facts = replace(curve.facts, settings=curve.facts.settings | {"dt": step})
        return Case("sphere_in_cylinder", {}, "", facts, QUESTION.until, QUESTION.every)

    assert _affordable(curve, case(2e-3), None, longest, 2)  # the first run of a curve tells how long it takes
    compiled = CurvePoint(case(4e-3), Result(Status.DONE, "reached", processor={"advance": 9.0}))
    curve.points = [compiled]
    assert _affordable(curve, case(2e-3), None, longest, 2), "the first may have compiled"
    curve.points = [compiled, CurvePoint(case(2e-3), Result(Status.DONE, "reached", processor={"advance": 1.0}))]
    assert _affordable(curve, case(1e-3), None, longest, 2) is kept
    assert curve.dropped == ({} if kept else {1e-3: too_long(longest or 0.0)})


def test_the_truth_begins_before_any_run(tmp_path: Path) -> None:
    """With a budget the truth is the first case, however many runs wait: without it all of them are worth nothing."""
    engines = [f"projection[formulation=rotating_frame,preset={preset}]" for preset in ("default", "matched")]
    curves, _ = curves_of(engines)

    def first(case: Case, _: Result) -> None:
        raise KeyboardInterrupt(case.engine.name)

    with pytest.raises(KeyboardInterrupt, match=r"^truth$"):
        sweep(QUESTION, curves, Runner(Store(tmp_path), jobs=1), first, budget=TimeBudget(60.0))


def test_a_coarser_truth_is_that_of_fewer_samples() -> None:
    """The truth at a coarser interval has the values of the finer one at its times, and none between."""
    question = Question("pendulum", {}, 0.4, "energy")
    times = time_grid(question.until, question.every)
    fine = truth(question.loaded, times, between=times[:1] + 0.3 * question.every)
    assert BETWEEN in fine.dims
    coarse = question.reference(fine, 0.1)
    assert np.array_equal(coarse.dataset["p_WB"], fine["p_WB"][::10])
    assert BETWEEN not in coarse.dataset.dims


@pytest.mark.drill
def test_runs_are_announced_before_they_end(tmp_path: Path) -> None:
    """A sweep announces each run before it ends, and no others: what has ended is never more than the total."""
    curves, _ = curves_of(["projection[formulation=rotating_frame,preset=default]"])
    total, totals = 0, []

    def announce(count: int) -> None:
        nonlocal total
        total += count

    def arrived(_: Case, __: Result) -> None:
        totals.append(total)

    sweep(QUESTION, curves, Runner(Store(tmp_path), jobs=1), arrived, announce=announce)
    assert len(totals) == total
    assert all(known >= ended for ended, known in enumerate(totals, 1))
