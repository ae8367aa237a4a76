"""The comparison: every engine of a comparison file against the truth, with one verdict per observable."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from proofroll.agreement import Judgement, Verdict, judge
from proofroll.case import LASTING, Case, EngineFacts, Result, Status
from proofroll.comparison import Band, Comparison, Row
from proofroll.convergence import Limit, richardson, tightest
from proofroll.errors import Missing, ProofrollError
from proofroll.metrics import Observable
from proofroll.runner import Runner, WorkerDied
from proofroll.scene_file import load_scene
from proofroll.studies.common_span import common_span
from proofroll.studies.planning import Plan, Planned, plan, point_name
from proofroll.studies.reference import OF_EVENTS, Reference
from proofroll.trajectory import read

if TYPE_CHECKING:
    import xarray as xr


def worst(judgements: Sequence[Judgement]) -> Verdict:
    """The worst verdict of any observable; failed if there is none."""
    order = list(Verdict)
    return max((judgement.verdict for judgement in judgements), key=order.index, default=Verdict.FAILED)


@dataclass(frozen=True)
class Run:
    """One row of the comparison at one point of its parameters.

    Attributes:
        row: the claim.
        parameters: the point.
        facts: the engine with complete settings, or None if it could not be asked.
        result: how the run itself ended.
        judgements: one per observable; empty if there is no trajectory.
        contradictions: sentences about what the claim did not expect.
        case: the run's case, or None.
    """

    row: Row
    parameters: dict[str, float]
    facts: EngineFacts | None
    result: Result
    judgements: list[Judgement] = field(default_factory=list)
    contradictions: list[str] = field(default_factory=list)
    case: Case | None = None

    @property
    def verdict(self) -> Verdict:
        """The worst verdict of any observable."""
        return worst(self.judgements) if self.result.status == Status.DONE else Verdict.FAILED


@dataclass(frozen=True)
class Outcome:
    """All that a comparison found."""

    comparison: Comparison
    runs: list[Run]
    truths: dict[str, Case]
    """The truth's case by :func:`point_name`."""

    @property
    def contradictions(self) -> list[str]:
        """What the comparison did not expect, as sentences."""
        return [sentence for run in self.runs for sentence in run.contradictions]

    @property
    def lost(self) -> list[Run]:
        """Runs whose engine is missing, crashed or hung, though the comparison does not expect a failure."""
        broken = {Status.MISSING, Status.CRASHED, Status.TIMEOUT}
        lost = [run for run in self.runs if run.result.status in broken]
        return [run for run in lost if Verdict.FAILED not in run.row.expected(run.parameters)]


# Observables that are judged even where the time of slip is ill-posed: they hold on every path.
_EVERYWHERE = frozenset({"energy_balance", "force_audit", "gap", "creep"})


def evaluate(planned: Plan, results: dict[str, Result], runner: Runner) -> Outcome:
    """Judges the results of a plan's cases."""
    comparison = planned.comparison
    judged: list[Run] = []
    references: dict[str, Reference] = {}
    for run in planned.runs:
        if isinstance(run.facts, ProofrollError):
            judged.append(_absent(run))
            continue
        main = run.ladder[1.0]
        result = results[main.key]
        if result.trajectory is None or result.status != Status.DONE:
            judged.append(_failed(run, run.facts, result))
            continue
        name = point_name(run.parameters)
        truth = results[planned.truths[name].key]
        if truth.status != Status.DONE:
            status = Status.REFUSED if truth.status in LASTING else truth.status
            nothing = Result(status, f"there is no truth here: {truth.message}", versions=result.versions)
            judged.append(_failed(run, run.facts, nothing))
            continue
        if name not in references:
            scene = load_scene(comparison.scene, **run.parameters)
            references[name] = Reference.read(scene, runner.store.trajectory(planned.truths[name]))
        trajectories = {
            factor: read(runner.store.trajectory(case))
            for factor, case in run.ladder.items()
            if results[case.key].status == Status.DONE
        }
        judgements = _judgements(run, comparison.bands[run.row.tolerance], references[name], trajectories)
        contradictions = _contradictions(comparison, run, judgements)
        judged.append(Run(run.row, run.parameters, run.facts, result, judgements, contradictions, main))
    return Outcome(comparison, judged, planned.truths)


def compare(
    comparison: Comparison,
    runner: Runner,
    engines: Iterable[str] = (),
    progress: Callable[[Case, Result], None] | None = None,
) -> Outcome:
    """Plans, runs and judges a comparison."""
    planned = plan(comparison, engines, runner.workers)
    return evaluate(planned, runner.run(planned.cases, progress), runner)


def _absent(run: Planned) -> Run:
    """A row whose engine could not even be asked."""
    assert isinstance(run.facts, ProofrollError)  # the caller looked
    status = Status.CRASHED
    if isinstance(run.facts, Missing):
        status = Status.MISSING
    elif isinstance(run.facts, WorkerDied):
        status = run.facts.status
    return Run(run.row, run.parameters, None, Result(status, str(run.facts)))


def _failed(run: Planned, facts: EngineFacts, result: Result) -> Run:
    expected = Verdict.FAILED in run.row.expected(run.parameters)
    sentence = f"{run.row.engine} at {point_name(run.parameters)} {result.status}: {result.message}"
    return Run(run.row, run.parameters, facts, result, [], [] if expected else [sentence], run.ladder[1.0])


def _judgements(
    run: Planned, band: Band, reference: Reference, trajectories: dict[float, xr.Dataset]
) -> list[Judgement]:
    reference, trajectories = common_span(reference, trajectories)
    curves = {factor: reference.observed(dataset) for factor, dataset in trajectories.items()}
    main = curves[1.0]
    judgements = []
    for name, curve in main.items():
        tolerance = run.row.bound.get(name) or band.bounds.get(name)
        if tolerance is None:
            continue
        true, bar = reference.true(name, curve)
        judgement = judge(
            name,
            curve.unit,
            curve.values,
            true,
            truth_error_bar=bar,
            tolerance=tolerance.absolute(reference.sizes.get(name, 1.0)),
            scale=reference.sizes.get(name, 1.0),
            limit=_limit(run, name, curves),
            ill_posed=reference.ill_posed and name not in _EVERYWHERE,
        )
        if reference.ill_posed and name in OF_EVENTS:
            judgement = dataclasses.replace(judgement, verdict=Verdict.ILL_POSED)  # agreement would be luck
        judgements.append(judgement)
    return judgements


def _limit(run: Planned, name: str, curves: dict[float, dict[str, Observable]]) -> Limit | None:
    """Limit of small steps, if every rung of the ladder gave the observable."""
    factors = run.row.ladder
    if len(factors) == 1 or not all(name in curves.get(factor, {}) for factor in factors):
        return None
    values = [curves[factor][name].values for factor in factors]
    if len({v.shape for v in values}) > 1 or not values[0].size or not all(np.all(np.isfinite(v)) for v in values):
        return None
    assert isinstance(run.facts, EngineFacts)  # there are curves
    if run.facts.resolution != "dt":
        return tightest(values)
    return richardson(values, run.row.ladder, run.facts.order)


def _contradictions(comparison: Comparison, run: Planned, judgements: list[Judgement]) -> list[str]:
    """What the claim did not expect, as sentences."""
    where = f"{run.row.engine} at {point_name(run.parameters)}"
    found = []
    overall = worst(judgements)
    # Only the truth makes a question ill-posed; where it does, that is expected of every engine.
    expected = run.row.expected(run.parameters)
    if overall not in {*expected, Verdict.ILL_POSED}:
        # Which observables make it so; where it is better than expected, all of them do.
        guilty = [judgement for judgement in judgements if judgement.verdict == overall]
        said = "; ".join(_said(judgement) for judgement in guilty)
        found.append(f"{where} {overall}, expected: {' or '.join(expected)} ({said})")
    for judgement in judgements:
        name = judgement.observable
        alone = run.row.expect_for.get(name)
        if alone is not None and judgement.verdict not in alone:
            found.append(f"{where}: {_said(judgement)}, expected: {' or '.join(alone)}")
        if name in run.row.order and not _within(judgement.order, run.row.order[name]):
            low, high = run.row.order[name]
            found.append(f"{where}: order of {name} is {judgement.order}, expected {low:g} to {high:g}")
        if name in run.row.limit:
            allowed = run.row.limit[name].absolute(judgement.scale)
            if judgement.limit_error is None or judgement.limit_error > allowed:
                found.append(f"{where}: limit of {name} is off by {judgement.limit_error}, expected {allowed:.3g}")
    row = run.row
    claimed = {*comparison.bands[row.tolerance].bounds, *row.bound, *row.expect_for, *row.order, *row.limit}
    for name in sorted(claimed - {judgement.observable for judgement in judgements}):
        found.append(f"{where}: {name} is not reported, though {comparison.name} makes a claim about it")
    return found


def _said(judgement: Judgement) -> str:
    error, tolerance = f"{judgement.error:.3g} {judgement.unit}", f"{judgement.tolerance:.3g}"
    return f"{judgement.observable} {judgement.verdict}, error {error} against {tolerance}"


def _within(value: float | None, bounds: tuple[float, float]) -> bool:
    return value is not None and bounds[0] <= value <= bounds[1]
