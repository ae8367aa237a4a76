"""The comparison: every engine of a comparison file against the truth, with one verdict per observable."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, Vectors, largest_difference
from proofroll.core.comparison import Band, Comparison
from proofroll.core.convergence import Limit, falls_faster, floor_of, richardson, scatter_of, tightest
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.element_abilities import longest_step
from proofroll.core.errors import ProofrollError
from proofroll.core.observable import Role
from proofroll.core.verdict import Allowance, Judgement, Refinement, RunCurve, Verdict, judge_curve
from proofroll.files.trajectory_file import StoredTrajectory
from proofroll.running.case import LASTING, Case, EngineFacts, Result, Status
from proofroll.running.process import status_of
from proofroll.running.runner import Runner
from proofroll.running.time_budget import TimeBudget
from proofroll.studies.comparison.expectations import contradictions_of
from proofroll.studies.comparison.outcome import ComparedPoint, LadderRun, Outcome, Run
from proofroll.studies.comparison.planning import Plan, Planned, at_point, plan, point_name
from proofroll.studies.judging import run_values
from proofroll.studies.judging.reference import OWN_STEPS, Reference

if TYPE_CHECKING:
    import xarray as xr


_OF_TRUTHS = 0.8  # largest part of a budget that truths take, at first and again for a shorter time
_PARTS = (1, 8, 64)  # parts of the time, the first of which is tried
_LEAST = 2  # samples of a truth with which a motion is judged: at the first one nothing has moved yet


def evaluate(planned: Plan, results: dict[str, Result], runner: Runner, *, diagnosing: bool = True) -> Outcome:
    """Judges the results of a plan's cases; ``diagnosing``: False leaves out causes of differences."""
    comparison = planned.comparison
    stored = {case.key: runner.store.stored(case) for case in planned.cases}
    points = {
        name: ComparedPoint(planned.scenes[name], case, results[case.key], stored[case.key])
        for name, case in planned.truths.items()
    }
    judged: list[Run] = []
    unfinished = left_out(results)
    for run in planned.runs:
        point = points[point_name(run.parameters)]
        if isinstance(run.facts, ProofrollError):
            judged.append(_run(run, Result(status_of(run.facts), str(run.facts))))
            continue
        if run.is_reference:
            no_judge = Result(Status.NO_TRUTH, OWN_STEPS)
            made = point.result.status == Status.DONE
            judged.append(_run(run, no_judge) if made else _without_truth(run, point, no_judge))
            continue
        result = results[run.ladder[1.0].key]
        if result.trajectory is None or result.status != Status.DONE:
            judged.append(_without_result(run, point, result))
            continue
        reference = point.reference if point.result.status == Status.DONE else None
        if reference is None:
            judged.append(_without_truth(run, point, result))
            continue
        built_scene = reference.another_scene(result.certificate)
        if built_scene is not None:
            judged.append(_of_another_scene(run, result, built_scene))
            continue
        trajectories = {
            factor: stored[case.key].dataset
            for factor, case in run.ladder.items()
            if results[case.key].status == Status.DONE
        }
        band = _told(comparison.bands[run.row.tolerance], comparison, reference)
        if reference.ill_posed and not reference.curves.keys() & {*band.bounds, *run.row.bound}:
            reason = f"no motion is unique here, and no law has a tolerance: {reference.ill_posed}"
            judged.append(_run(run, replace(result, status=Status.NO_TRUTH, message=reason)))
            continue
        laws = {name for name, item in reference.scene.observables.items() if not item.hangs_on_events}
        if reference.ended and reference.dataset.sizes["time"] < _LEAST and not laws & {*band.bounds, *run.row.bound}:
            judged.append(_run(run, replace(result, status=Status.NO_TRUTH, message=reference.ended)))
            continue
        judgements, errors = _judgements(run, band, reference, trajectories, _lost(run, results))
        missing = sorted({*band.bounds, *run.row.bound} - {judgement.observable for judgement in judgements})
        judged_run = _run(
            run,
            result,
            judgements=judgements,
            contradictions=contradictions_of(
                comparison, run, judgements, missing, bool(unfinished & run.keys(planned.truths))
            ),
            missing=missing,
            shared=reference.shared(run.facts.shares),
            rungs=_rungs(run, results, errors),
        )
        if diagnosing and judged_run.verdict == Verdict.DIFFERS:
            true, main = reference.dataset, trajectories[1.0]
            causes = diagnose_scene(reference.scene, result.certificate, main, true, run.facts.step, judgements)
            judged_run = replace(judged_run, diagnosis=causes)
        judged.append(judged_run)
    judged = [run if run.result.trajectory is None else _with_trajectory(run, stored) for run in judged]
    return Outcome(
        comparison=comparison,
        scene=planned.scene,
        file=planned.file,
        runs=judged,
        points=points,
        beyond_budget=_beyond_budget(planned, results),
    )


def _told(band: Band, comparison: Comparison, reference: Reference) -> Band:
    """The band; for a comparison without a file only what is determined, within its tolerances.

    A truth whose error bar is larger than a tolerance leaves a row without judgement; a reference by steps does not.
    """
    if comparison.asked:
        return band
    told = {
        name: bound
        for name, bound in band.bounds.items()
        if reference.determines(name)
        and (not reference.by_steps or reference.tells(name, bound.absolute(reference.sizes.get(name, 1.0))))
    }
    return replace(band, bounds=told) if told else band


def left_out(results: Mapping[str, Result]) -> set[str]:
    """Keys of the cases that were left out for lack of processor time."""
    return {key for key, result in results.items() if result.status is Status.LEFT_OUT}


def settled(planned: Plan, results: Mapping[str, Result], runner: Runner) -> Plan:
    """The plan without spare steps where the own step agrees as the file expects, or has nothing to judge.

    A row whose own step has no result yet stays as it is.
    """
    trials = [(run, run.own_step) for run in planned.runs if run.spare and len(run.ladder) > 1]
    trials = [(run, trial) for run, trial in trials if trial.keys(planned.truths) <= results.keys()]
    if not trials:
        return planned
    names = {point_name(trial.parameters) for _, trial in trials}
    truths = {name: case for name, case in planned.truths.items() if name in names}
    asked = replace(planned, truths=truths, runs=[trial for _, trial in trials])
    decided: dict[int, Planned] = {}
    for (run, trial), judged in zip(trials, evaluate(asked, {**results}, runner, diagnosing=False).runs, strict=True):
        as_expected = judged.verdict is Verdict.AGREES and not judged.contradictions
        needless = as_expected or judged.result.status is not Status.DONE
        decided[id(run)] = trial if needless else replace(run, spare=False)
    return replace(planned, runs=[decided.get(id(run), run) for run in planned.runs])


def run_plans(
    plans: Sequence[Plan], runner: Runner, progress: Callable[[Case, Result], None] | None = None
) -> tuple[list[Plan], dict[str, Result]]:
    """Plans without needless steps, and results of their cases by key."""
    results: dict[str, Result] = {}
    for item in plans:
        results |= run_within_budget(item, runner, progress)
    results |= runner.run([case for item in plans for case in item.first_cases if case.key not in results], progress)
    plans = [settled(item, results, runner) for item in plans]
    further = [case for item in plans for case in item.cases if case.key not in results]
    return plans, results | runner.run(further, progress)


def run_within_budget(
    planned: Plan, runner: Runner, progress: Callable[[Case, Result], None] | None = None
) -> dict[str, Result]:
    """Results of a plan's cases by key, the most useful cases first; empty without a budget."""
    results: dict[str, Result] = {}
    if planned.comparison.budget is None:
        return results
    budget = TimeBudget(planned.comparison.budget, planned.comparison.spent)
    for cases in planned.stages:
        lost = _without_ladder(planned, results)
        for case in cases:
            if progress and case.key in lost:
                progress(case, lost[case.key])
        results |= lost | runner.run([case for case in cases if case.key not in lost], progress, budget)
    return results


def _without_ladder(planned: Plan, results: Mapping[str, Result]) -> dict[str, Result]:
    """Results of the further steps of rows whose own step has no result: not run, for they judge nothing then."""
    ladders = [(run.ladder.values(), results.get(run.ladder[1.0].key)) for run in planned.runs if run.ladder]
    lost, awaited = dict[str, Result](), {*results}
    for cases, result in ladders:
        keys = [case.key for case in cases]
        if result is None or result.status in {Status.DONE, Status.LEFT_OUT}:
            awaited |= {*keys}
        else:
            why = f"the own step gave nothing ({result.status}: {result.message})"
            lost |= dict.fromkeys(keys, Result(Status.NOT_RUN, why))
    return {key: result for key, result in lost.items() if key not in awaited}


def affordable(planned: Plan, runner: Runner) -> Plan:
    """The plan, or as much of its time as the budget leaves a truth for; its truths have then been run.

    A truth takes a part of the budget at most: with all of it spent on a truth that does not end, nothing is judged.
    """
    comparison = planned.comparison
    if comparison.budget is None:
        return planned
    spent, intervals = comparison.spent, round(comparison.until / comparison.every)
    for parts in _PARTS:
        if parts > 1 and intervals // parts < _LEAST:
            break
        trial = planned if parts == 1 else planned.shortened(comparison.every * (intervals // parts))
        reserved = (1 - _OF_TRUTHS) * max(0.0, comparison.budget - spent)
        budget = TimeBudget(comparison.budget, spent + reserved)
        before = budget.left
        results = runner.run(trial.stages[0], budget=budget)
        spent += before - budget.left
        if not left_out(results):
            return replace(trial, comparison=replace(trial.comparison, spent=spent))
    # No truth ends in time: nothing is run that could not be judged.
    return replace(planned, comparison=replace(comparison, spent=comparison.budget))


def _beyond_budget(planned: Plan, results: Mapping[str, Result]) -> list[str]:
    """Texts of the cases that were left out for lack of processor time."""
    cases = [(f"the truth{at_point(case.parameters)}", case) for case in planned.truths.values()]
    cases += [
        (f"{run.row.engine}{at_point(run.parameters)}", case) for run in planned.runs for case in run.ladder.values()
    ]
    left = [(name, case.engine) for name, case in cases if results[case.key].status is Status.LEFT_OUT]
    return [f"{name}, {e.resolution} {e.settings[e.resolution]:g}" if e.resolution else name for name, e in left]


def compare(
    comparison: Comparison,
    runner: Runner,
    engines: Iterable[str] = (),
    progress: Callable[[Case, Result], None] | None = None,
) -> Outcome:
    """Plans, runs and judges a comparison."""
    planned = affordable(plan(comparison, engines, runner.workers), runner)
    (planned,), results = run_plans([planned], runner, progress)
    return evaluate(planned, results, runner)


def _run(planned: Planned, result: Result, **judged: Any) -> Run:
    """A run of a plan with its result and judgements."""
    facts = planned.facts if isinstance(planned.facts, EngineFacts) else None
    return Run(planned.row, planned.parameters, facts, result, case=planned.ladder.get(1.0), **judged)


def _with_trajectory(run: Run, stored: Mapping[str, StoredTrajectory]) -> Run:
    """The run with its trajectory, if its file exists."""
    trajectory = stored[run.case.key] if run.case else None
    return replace(run, trajectory=trajectory if trajectory and trajectory.file.is_file() else None)


def _without_result(run: Planned, point: ComparedPoint, result: Result) -> Run:
    """Row that was refused, failed, or was left out for lack of time, which contradicts no claim."""
    causes = diagnose_scene(point.scene, result.certificate, step=run.ladder[1.0].engine.step)
    failed = _run(run, result, diagnosis=causes)
    expected = run.row.expected(run.parameters)
    if failed.verdict in expected or result.status is Status.LEFT_OUT:
        return failed
    place = f"{run.row.engine}{at_point(run.parameters)}"
    contradiction = f"{place} {result.status}, expected: {' or '.join(expected)} ({result.message})"
    return replace(failed, contradictions=[contradiction])


# Clause on a truth that gave no answer; a refusal is its answer.
_TRUTH_LOST = {Status.TIMEOUT: "the truth took too long: "}


def _without_truth(run: Planned, point: ComparedPoint, result: Result) -> Run:
    """Row at a point without a truth, which is not judged: left out if the truth was, or with the reason."""
    truth = point.result
    if truth.status is Status.LEFT_OUT:
        return _run(run, replace(result, status=truth.status, message=truth.message))
    clause = "" if truth.status in LASTING else _TRUTH_LOST.get(truth.status, "the truth ended in an error: ")
    return _run(run, replace(result, status=Status.NO_TRUTH, message=f"{clause}{truth.message}"))


def _of_another_scene(run: Planned, result: Result, sentence: str) -> Run:
    """Row whose engine ran a model of a different kind: shown with its trajectory, but not judged."""
    result = replace(result, status=Status.ANOTHER_SCENE, message=sentence)
    expected = {Verdict.ANOTHER_SCENE, Verdict.DIFFERS, Verdict.FAILED} & set(run.row.expected(run.parameters))
    contradictions = [] if expected else [f"{run.row.engine}{at_point(run.parameters)}: {sentence}"]
    return _run(run, result, contradictions=contradictions)


def _judgements(
    run: Planned, band: Band, reference: Reference, trajectories: dict[float, xr.Dataset], lost: str
) -> tuple[list[Judgement], dict[float, dict[str, float]]]:
    """Judgements of a run, and factor of each other rung of its ladder -> observable -> error."""
    facts = run.facts
    assert isinstance(facts, EngineFacts)  # there are trajectories
    laws = {factor: run_values.laws_behind_the_end(reference, dataset) for factor, dataset in trajectories.items()}
    reference, trajectories = reference.common_span(trajectories)
    curves = {
        factor: run_values.observables_of(reference, dataset) | laws[factor] for factor, dataset in trajectories.items()
    }
    main = curves[1.0]
    judgements: list[Judgement] = []
    errors: dict[float, dict[str, float]] = {factor: {} for factor in curves if factor != 1}
    longest = longest_step(reference.scene.elements)
    always, tolerances = run_values.always_judged(reference, main), band.bounds | run.row.bound
    if reference.ended and {reference.scene.observables[name].role for name in tolerances} == {Role.RESIDUAL}:
        always = {}  # laws alone are asked for, which hold behind the end of the truth too
    for name, curve in main.items():
        tolerance = tolerances.get(name) or always.get(name)
        if tolerance is None:
            continue
        true, scale = reference.true(name, curve), reference.sizes.get(name, 1.0)
        run_curve = run_values.run_curve(reference, name, curve, trajectories[1.0], facts.precision)
        limit = _limit(run, facts, name, curves, run_curve, longest)
        if limit is not None:
            finest = [factor for factor in run.row.ladder if factor in trajectories][-1]
            step = None if facts.step is None else facts.step * finest
            beside = reference.beside(name, limit.values, trajectories[finest], step)
            if not limit.regular:
                limit = replace(limit, unsettled=reference.unsettled(name, _last_change(run, name, curves)))
            limit = replace(limit, beside=beside, floor=_floor(facts, name, limit, curves, true.values, reference))
        ladder = facts.resolution is not None and len(run.row.ladder) > 1 and curve.size > 0
        ladder = ladder and not (run.spare and len(run.ladder) == 1)
        allowance = Allowance(name, reference.scene.observables[name].unit, tolerance.absolute(scale), scale)
        faster = limit is not None and _falls_faster(run, name, curves, true.values, run_curve.vectors)
        judgement = judge_curve(allowance, run_curve, true, Refinement(limit, ladder, lost, faster))
        if name not in tolerances and judgement.verdict is not Verdict.DIFFERS:
            continue
        judgements.append(judgement)
        for factor, own_errors in errors.items():
            if name in curves[factor]:
                rung = curves[factor][name]
                own_errors[name] = run_values.error(reference, name, rung, trajectories[factor])
    remark = run_values.rates_remark(reference, trajectories[1.0].variables, tolerances)
    if remark and judgements and all(item.verdict in {Verdict.AGREES, Verdict.UNCONFIRMED} for item in judgements):
        judgements[0] = replace(judgements[0], remarks=(*judgements[0].remarks, remark))
    return judgements, errors


def _rungs(run: Planned, results: dict[str, Result], errors: dict[float, dict[str, float]]) -> list[LadderRun]:
    """Further runs of a row's ladder, without the run at the row's own step."""
    rungs = []
    for factor, case in run.ladder.items():
        facts = case.engine
        if factor != 1 and facts.resolution is not None:
            rungs.append(LadderRun(facts.settings[facts.resolution], results[case.key], errors.get(factor, {})))
    return rungs


def _limit(
    run: Planned,
    facts: EngineFacts,
    name: str,
    curves: dict[float, dict[str, FloatArray]],
    run_curve: RunCurve,
    longest: float,
) -> Limit | None:
    """Limit of small steps of an observable, if every rung has it.

    ``run_curve``: at the row's own step; ``longest``: stable step [s], beyond which irregular differences show nothing.
    """
    stepped = facts.resolution == "dt"
    # tolerances that the engine refuses are left out
    factors = run.row.ladder if stepped else [factor for factor in run.row.ladder if factor in run.ladder]
    if len(factors) == 1 or not all(name in curves.get(factor, {}) for factor in factors):
        return None
    values = [curves[factor][name] for factor in factors]
    if len({v.shape for v in values}) > 1 or not values[0].size or not all(np.all(np.isfinite(v)) for v in values):
        return None
    if not stepped:
        return tightest(values, run_curve.vectors)
    finest = run.ladder[factors[-1]]
    steps = finest.until / (finest.engine.step or finest.until)
    scatter = scatter_of(facts.precision, run_curve.magnitude, steps)
    limit = richardson(values, run.row.ladder, facts.order, scatter, run_curve.vectors)
    unstable = facts.step is not None and max(run.row.ladder) * facts.step > longest
    return replace(limit, order=float("nan"), shown=False) if unstable and not limit.regular else limit


def _last_change(run: Planned, name: str, curves: dict[float, dict[str, FloatArray]]) -> FloatArray:
    """Difference of an observable by the last refinement."""
    middle, fine = (curves[factor][name] for factor in [factor for factor in run.row.ladder if factor in curves][-2:])
    return fine - middle


def _falls_faster(
    run: Planned, name: str, curves: dict[float, dict[str, FloatArray]], true: FloatArray, vectors: Vectors
) -> bool:
    """True if the errors of a row's steps fall ever faster; see :func:`proofroll.core.convergence.falls_faster`."""
    factors = [factor for factor in run.row.ladder if factor in curves]
    return falls_faster([largest_difference(curves[factor][name], true, vectors) for factor in factors], factors)


def _floor(
    facts: EngineFacts,
    name: str,
    limit: Limit,
    curves: dict[float, dict[str, FloatArray]],
    true: FloatArray,
    reference: Reference,
) -> str:
    """Clause on the error floor where single precision hides the limit; else empty."""
    if not limit.rounded or facts.step is None:
        return limit.floor
    errors = {
        facts.step * factor: largest_difference(observed[name], true, reference.vectors(name))
        for factor, observed in curves.items()
    }
    return floor_of(errors, reference.scale(name), reference.scene.observables[name].unit)


def _lost(run: Planned, results: dict[str, Result]) -> str:
    """First step of the ladder without a trajectory, and why; empty if each has one."""
    for factor, case in run.ladder.items():
        result, name = results[case.key], case.engine.resolution
        if factor in {1.0, *run.row.ladder} and result.status != Status.DONE and name is not None:
            return f"{name} {case.engine.settings[name]:g} {result.status}: {result.message}"
    return ""
