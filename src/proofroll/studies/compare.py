"""The comparison: every engine of a comparison file against the truth, with one verdict per observable."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from proofroll.agreement import Judgement, Verdict, judge
from proofroll.case import Case, EngineFacts, Result, Status
from proofroll.comparison_file import Band, Comparison, Row
from proofroll.convergence import Limit, richardson, tightest
from proofroll.errors import InputError, Missing, ProofrollError
from proofroll.metrics import Observable, observables, scales
from proofroll.registry import parse_engine
from proofroll.runner import Runner, WorkerDied, resolve
from proofroll.scene import Scene
from proofroll.scene_file import load_scene
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
        """Runs whose engine is missing, crashed or hung."""
        broken = {Status.MISSING, Status.CRASHED, Status.TIMEOUT}
        return [run for run in self.runs if run.result.status in broken]


def point_name(parameters: dict[str, float]) -> str:
    """A point of the parameters as text, e.g. ``speed=4, rolling_resistance=0.0005``."""
    return ", ".join(f"{key}={value:g}" for key, value in parameters.items())


@dataclass(frozen=True)
class Planned:
    """A run with the cases of its ladder, coarse first; the run's own case is ``main``."""

    row: Row
    parameters: dict[str, float]
    facts: EngineFacts | ProofrollError
    ladder: list[Case] = field(default_factory=list)
    main: Case | None = None


@dataclass(frozen=True)
class Plan:
    """The cases of a comparison: to be run together with those of others, then judged."""

    comparison: Comparison
    truths: dict[str, Case]
    runs: list[Planned]

    @property
    def cases(self) -> list[Case]:
        """Every case once or more; the runner runs equal ones once."""
        return [*self.truths.values(), *(case for run in self.runs for case in run.ladder)]


def plan(comparison: Comparison, engines: Iterable[str] = ()) -> Plan:
    """The cases of a comparison.

    Args:
        comparison: from :func:`proofroll.comparison_file.load_comparison`.
        engines: names of engines to which it is restricted; all if empty.

    Raises:
        InputError: an engine or setting that does not exist.
    """
    chosen = set(engines)
    rows = [row for row in comparison.rows if not chosen or parse_engine(row.engine).name in chosen]
    if not rows:
        known = ", ".join(dict.fromkeys(parse_engine(row.engine).name for row in comparison.rows))
        raise InputError("engine", ", ".join(chosen), f"{comparison.name} compares {known}")
    specs = [parse_engine(row.engine) for row in rows]
    resolved = resolve([(spec.name, spec.options) for spec in specs] + [("truth", {})])
    truth_facts = resolved.pop()
    if not isinstance(truth_facts, EngineFacts):
        raise truth_facts
    rungs = _rungs(rows, resolved)
    truths: dict[str, Case] = {}
    runs: list[Planned] = []
    for row, facts, ladder_facts in zip(rows, resolved, rungs, strict=True):
        if isinstance(facts, InputError):
            raise facts
        for point in comparison.variations(row):
            scene = load_scene(comparison.scene, **point)
            truths.setdefault(point_name(point), _case(comparison, scene, point, truth_facts))
            if not isinstance(facts, EngineFacts):
                runs.append(Planned(row, point, facts))
                continue
            main = _case(comparison, scene, point, facts, timed=True)
            ladder = [main if f is facts else _case(comparison, scene, point, f) for f in ladder_facts]
            runs.append(Planned(row, point, facts, ladder, main))
    return Plan(comparison, truths, runs)


def _rungs(rows: list[Row], resolved: list[EngineFacts | ProofrollError]) -> list[list[EngineFacts]]:
    """For every row the facts of its ladder: its own settings with the resolution scaled."""
    wanted: list[tuple[int, float, EngineFacts]] = []
    for index, (row, facts) in enumerate(zip(rows, resolved, strict=True)):
        if isinstance(facts, EngineFacts) and facts.resolution is not None:
            wanted += [(index, factor, facts) for factor in row.ladder]
    scaled = [
        (facts.name, {**facts.settings, facts.resolution: facts.settings[facts.resolution] * _scaled(facts, factor)})
        for _, factor, facts in wanted
        if facts.resolution is not None
    ]
    ladders: list[list[EngineFacts]] = [[] for _ in rows]
    for (index, factor, facts), found in zip(wanted, resolve(scaled), strict=True):
        if factor == 1:
            ladders[index].append(facts)
        elif isinstance(found, EngineFacts):
            ladders[index].append(found)
    return ladders


def _scaled(facts: EngineFacts, factor: float) -> float:
    """Factor on the resolution: a tolerance is loosened by decades where a step is doubled."""
    return factor if facts.resolution == "dt" else float(10 ** np.log2(factor))


def _case(
    comparison: Comparison, scene: Scene, point: dict[str, float], facts: EngineFacts, timed: bool = False
) -> Case:
    return Case(
        scene=comparison.scene,
        parameters=point,
        scene_digest=scene.digest,
        engine=facts,
        until=comparison.until,
        every=comparison.every,
        timed=timed,
        time_limit=comparison.time_limit,
    )


def evaluate(planned: Plan, results: dict[str, Result], runner: Runner) -> Outcome:
    """Judges the results of a plan's cases."""
    comparison = planned.comparison
    judged: list[Run] = []
    references: dict[str, _Reference] = {}
    for run in planned.runs:
        if isinstance(run.facts, ProofrollError):
            judged.append(_absent(run))
            continue
        assert run.main is not None  # it goes with the facts
        result = results[run.main.key]
        if result.trajectory is None or result.status != Status.DONE:
            judged.append(_failed(run, run.facts, result))
            continue
        name = point_name(run.parameters)
        if name not in references:
            references[name] = _reference(comparison, run.parameters, planned.truths[name], results, runner)
        trajectories = [
            read(runner.store.trajectory(case)) if results[case.key].status == Status.DONE else None
            for case in run.ladder
        ]
        judgements = _judgements(run, comparison.bands[run.row.tolerance], references[name], trajectories)
        contradictions = _contradictions(comparison, run, judgements)
        judged.append(Run(run.row, run.parameters, run.facts, result, judgements, contradictions, run.main))
    return Outcome(comparison, judged, planned.truths)


def compare(
    comparison: Comparison,
    runner: Runner,
    engines: Iterable[str] = (),
    progress: Callable[[Case, Result], None] | None = None,
) -> Outcome:
    """Plans, runs and judges a comparison."""
    planned = plan(comparison, engines)
    return evaluate(planned, runner.run(planned.cases, progress), runner)


@dataclass(frozen=True)
class _Reference:
    """The truth at one point of the parameters, with everything derived from it."""

    scene: Scene
    dataset: xr.Dataset
    curves: dict[str, Observable]
    sizes: dict[str, float]


def _reference(
    comparison: Comparison, point: dict[str, float], case: Case, results: dict[str, Result], runner: Runner
) -> _Reference:
    result = results[case.key]
    if result.status != Status.DONE:
        raise ProofrollError(f"there is no truth for {comparison.scene} ({point_name(point)}): {result.message}")
    scene = load_scene(comparison.scene, **point)
    dataset = read(runner.store.trajectory(case))
    return _Reference(scene, dataset, observables(scene.rolling, dataset), scales(scene.rolling, dataset))


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
    expected = Verdict.FAILED in run.row.expect
    sentence = f"{run.row.engine} at {point_name(run.parameters)} {result.status}: {result.message}"
    return Run(run.row, run.parameters, facts, result, [], [] if expected else [sentence], run.main)


def _judgements(
    run: Planned, band: Band, reference: _Reference, trajectories: list[xr.Dataset | None]
) -> list[Judgement]:
    body = reference.scene.rolling
    curves = [None if dataset is None else observables(body, dataset) for dataset in trajectories]
    main = curves[run.row.ladder.index(1.0)] if len(curves) == len(run.row.ladder) else curves[-1]
    assert main is not None  # the run itself is done
    judgements = []
    for name, curve in main.items():
        tolerance = run.row.bound.get(name) or band.bounds.get(name)
        if tolerance is None:
            continue
        true = reference.curves[name].values
        zero_by_definition = name not in reference.dataset or name in {"gap"}
        bar = float(np.max(np.abs(true))) if zero_by_definition else float(reference.dataset[name].attrs["error_bar"])
        judgements.append(
            judge(
                name,
                curve.unit,
                curve.values,
                np.zeros_like(true) if zero_by_definition else true,
                truth_error_bar=bar,
                tolerance=tolerance.absolute(reference.sizes[name]),
                scale=reference.sizes[name],
                limit=_limit(run, name, curves),
            )
        )
    return judgements


def _limit(run: Planned, name: str, curves: list[dict[str, Observable] | None]) -> Limit | None:
    """Limit of small steps, if every rung of the ladder gave the observable."""
    values = [curve[name].values for curve in curves if curve is not None and name in curve]
    if len(values) != len(run.row.ladder) or not all(np.all(np.isfinite(v)) for v in values):
        return None
    assert isinstance(run.facts, EngineFacts)  # there are curves
    if run.facts.resolution != "dt":
        return tightest(values)
    return richardson(values, run.row.ladder[0] / run.row.ladder[1])


def _contradictions(comparison: Comparison, run: Planned, judgements: list[Judgement]) -> list[str]:
    """What the claim did not expect, as sentences."""
    where = f"{run.row.engine} at {point_name(run.parameters)}"
    found = []
    overall = worst(judgements)
    if overall not in run.row.expect:
        # Which observables make it so; where it is better than expected, all of them do.
        guilty = [judgement for judgement in judgements if judgement.verdict == overall]
        said = "; ".join(_said(judgement) for judgement in guilty)
        found.append(f"{where} {overall}, expected: {' or '.join(run.row.expect)} ({said})")
    for judgement in judgements:
        name = judgement.observable
        expected = run.row.expect_for.get(name)
        if expected is not None and judgement.verdict not in expected:
            found.append(f"{where}: {_said(judgement)}, expected: {' or '.join(expected)}")
        if name in run.row.order and not _within(judgement.order, run.row.order[name]):
            low, high = run.row.order[name]
            found.append(f"{where}: order of {name} is {judgement.order}, expected {low:g} to {high:g}")
        if name in run.row.limit:
            allowed = run.row.limit[name].absolute(judgement.scale)
            if judgement.limit_error is None or judgement.limit_error > allowed:
                found.append(f"{where}: limit of {name} is off by {judgement.limit_error}, expected {allowed:.3g}")
    missing = [name for name in run.row.expect_for if name not in {j.observable for j in judgements}]
    found += [f"{where}: {name} is not reported, though {comparison.name} expects a verdict on it" for name in missing]
    return found


def _said(judgement: Judgement) -> str:
    error, tolerance = f"{judgement.error:.3g} {judgement.unit}", f"{judgement.tolerance:.3g}"
    return f"{judgement.observable} {judgement.verdict}, error {error} against {tolerance}"


def _within(value: float | None, bounds: tuple[float, float]) -> bool:
    return value is not None and bounds[0] <= value <= bounds[1]
