"""Records of a comparison (:mod:`proofroll.report.comparison.records`), made from its outcome."""

import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any

from proofroll.core.comparison import Comparison, Tolerance
from proofroll.core.dataset import HORIZON
from proofroll.core.diagnosis.scene_diagnosis import Diagnosis
from proofroll.core.element_abilities import step_bound
from proofroll.core.number_format import number
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.verdict import SEVERITY, Judgement, Verdict
from proofroll.files.trajectory_file import StoredTrajectory
from proofroll.report.comparison.distances import distances_of
from proofroll.report.comparison.records import (
    CoarserSteps,
    ReportedComparison,
    ReportedRow,
    ReportedRun,
    Setting,
    ShownObservable,
    WorstJudgement,
    clean_cost,
    rough_cost,
)
from proofroll.report.comparison.spread import spread_of
from proofroll.report.kinds import group_of, kind_name
from proofroll.report.labels import setting_words
from proofroll.running.case import EngineFacts, Status, hosts
from proofroll.running.environments import shown_name
from proofroll.studies.comparison.outcome import Outcome, Run
from proofroll.studies.comparison.planning import at_point, point_name
from proofroll.studies.judging.reference import Reference


def reported(outcome: Outcome) -> tuple[list[ReportedRow], list[ReportedRun]]:
    """Rows of a comparison, and its runs."""
    until = outcome.comparison.until
    runs = [[_run(run, number, until) for run in of_row] for number, of_row in enumerate(outcome.rows)]
    rows = [ReportedRow(claim=of_row[0].row, **_summary(made)) for of_row, made in zip(outcome.rows, runs, strict=True)]
    return rows, [run for made in runs for run in made]


def outcome_content(outcome: Outcome) -> ReportedComparison:
    """Content of a comparison's section in a report."""
    comparison = outcome.comparison
    scene = next((point.scene for point in outcome.points.values()), outcome.scene)
    steps = {run.facts.step for run in outcome.runs if run.facts is not None and run.facts.step is not None}
    rows, runs = reported(outcome)
    return ReportedComparison(
        name=comparison.name,
        asked=comparison.asked,
        title=comparison.title,
        question=comparison.question,
        scene=comparison.scene,
        group=group_of(scene),
        shown_by=kind_name(scene),
        requires=sorted(scene.requires),
        observables={
            name: ShownObservable(
                unit=item.unit, symbol=item.shown, role=item.role, headline=item.headline, audit=item.audit
            )
            for name, item in scene.observables.items()
        },
        until=comparison.until,
        every=comparison.every,
        vary=comparison.vary,
        points=comparison.points,
        left_out=comparison.left_out,
        as_expected=not outcome.contradictions,
        contradictions=outcome.contradictions,
        tolerances=comparison.bands,
        rows=rows,
        runs=runs,
        hosts=hosts(run.result for run in outcome.runs),
        spread=[
            spread_of(
                name,
                outcome.points[name],
                {row: stored.dataset for row, _, stored in runs_at(outcome, name)},
                len(outcome.rows),
            )
            for name in outcome.laws_alone
        ],
        distances=[
            item
            for name, point in outcome.points.items()
            if (item := distances_of(name, point.reference, {row: run for row, run, _ in runs_at(outcome, name)}))
        ],
        budget=comparison.budget,
        beyond_budget=outcome.beyond_budget,
        truth_ends=[*_truth_ends(outcome), *([outcome.no_contact] if outcome.no_contact else _quiet(outcome))],
        step_bound=step_bound(scene.elements, steps),
        omitted=list(scene.omitted),
        unfit=comparison.unfit,
        unjudged=[] if comparison.asked else _unjudged(scene, comparison),
    )


def _unjudged(scene: Scene, comparison: Comparison) -> list[str]:
    """Reactions of a scene, with ``*`` for the parts of its mechanism, that no tolerance of a comparison judges."""
    bounds = {name for band in comparison.bands.values() for name in band.bounds}
    return _shortened(
        name
        for name, item in scene.observables.items()
        if item.role is Role.REACTION and item.unit != "1" and name not in bounds and not item.absent
    )


def _shortened(names: Iterable[str]) -> list[str]:
    """Names of observables, with ``*`` for the parts of a mechanism."""
    return list(dict.fromkeys(f"{name.partition('.')[0]}.*" if "." in name else name for name in names))


def _truth_ends(outcome: Outcome) -> list[str]:
    """Sentences about references by steps, and about truths that end early, one for each point with such a truth."""
    truths = {name: point.reference for name, point in outcome.points.items() if point.reference is not None}
    bounds = {name: bound for band in outcome.comparison.bands.values() for name, bound in band.bounds.items()}
    by_steps = {_by_steps_words(reference, bounds): None for reference in truths.values() if reference.by_steps}
    ends = [
        f"Nothing is judged behind the last value{at_point(outcome.points[name].case.parameters)}: {reference.ended}."
        for name, reference in truths.items()
        if reference.ended
    ]
    open_names = [name for name in bounds if not all(reference.determines(name) for reference in truths.values())]
    if open_names and not outcome.comparison.asked and not by_steps:
        ends.append(f"Not determined by the equations, and so not judged: {', '.join(open_names)}.")
    return [*by_steps, *ends]


def _by_steps_words(reference: Reference, bounds: Mapping[str, Tolerance]) -> str:
    """Sentence on a reference by steps: what it is, its error bar, and what it does not tell to these tolerances."""
    name = next((name for name in bounds if reference.tells(name, math.inf)), "")
    precision = f"; {name} known to {_with_unit(reference, name)}" if name else ""
    untold = [
        key for key, bound in bounds.items() if not reference.tells(key, bound.absolute(reference.sizes.get(key, 1.0)))
    ]
    leaves = f" Not told by it to the tolerance: {', '.join(_shortened(untold))}." if untold else ""
    horizon = str(reference.dataset.attrs.get(HORIZON, ""))
    horizon = f" Horizon: {horizon}." if horizon else ""
    return f"Judged by a {reference.dataset.attrs['route']}, which is no truth{precision}.{horizon}{leaves}"


def _with_unit(reference: Reference, name: str) -> str:
    """Error bar of an observable with its unit."""
    bar = reference.true(name, reference.curves[name]).error_bar
    return f"{number(bar, 2)} {reference.scene.observables[name].unit}"


def _quiet(outcome: Outcome) -> list[str]:
    """Sentence on truths in which nothing moves or touches, if that is so at every point of the parameters."""
    references = [point.reference for point in outcome.points.values() if point.reference is not None]
    return list(dict.fromkeys(item.quiet for item in references)) if all(item.quiet for item in references) else []


def runs_at(outcome: Outcome, point: str) -> list[tuple[int, Run, StoredTrajectory]]:
    """Row number, run and trajectory of every run at a point, if it has a trajectory."""
    return [
        (number, run, run.trajectory)
        for number, runs in enumerate(outcome.rows)
        for run in runs
        if point_name(run.parameters) == point and run.trajectory is not None
    ]


def row_at(row: ReportedRow, runs: list[ReportedRun]) -> ReportedRow:
    """Row over its runs at one point, whose reason names no point; without remarks, which are about all runs."""
    return dataclasses.replace(row, **_summary(runs) | {"remarks": [], "reason": runs[0].reason})


def _summary(runs: list[ReportedRun]) -> dict[str, Any]:
    """Fields of a row about its runs: the worst verdict of all points and the largest cost."""
    # A point where the question is ill-posed or not judged does not count against an engine.
    judged = [run for run in runs if run.verdict not in {Verdict.ILL_POSED, Verdict.NOT_JUDGED}] or runs
    names = list(dict.fromkeys(judgement.observable for run in judged for judgement in run.judgements))
    reason, limit = _why(judged)
    observables = {name: _worst(judged, name) for name in names}
    causes: dict[str, Diagnosis] = {}
    for item in (item for run in runs for item in run.diagnosis):
        causes.setdefault(item.cause.id, item)
    return {
        **{item.name: getattr(runs[0], item.name) for item in dataclasses.fields(Setting)},
        "verdict": max((run.verdict for run in judged), key=SEVERITY.index),
        "verdicts": {verdict.value: sum(run.verdict == verdict for run in runs) for verdict in Verdict},
        "reason": reason,
        "limit": limit,
        "shared": next((run.shared for run in runs if run.shared), ""),
        "missing": sorted({name for run in runs for name in run.missing}),
        "remarks": _remarks(runs),
        "diagnosis": list(causes.values()),
        "as_expected": not any(run.contradictions for run in runs),
        "observables": observables,
        "worst": max(names, key=lambda name: _severity(observables[name]), default=""),
        "seconds_per_second": max((x for run in runs if (x := run.seconds_per_second) is not None), default=None),
        "rough_cost": max((x for run in runs if (x := run.rough_cost) is not None), default=None),
        "message": next((run.message for run in runs if run.status != Status.DONE), ""),
        "coarser": max((run.coarser for run in runs), key=list(CoarserSteps).index),
    }


def _severity(item: Judgement) -> tuple[int, float]:
    """Sort key of a judgement: its verdict, then its error over what is allowed."""
    return SEVERITY.index(item.verdict), item.of_allowed


def _why(runs: list[ReportedRun]) -> tuple[str, str]:
    """Reason of the worst verdict, empty if everything agrees; and the result of its ladder of steps, ``limit``."""
    worst = max((run.verdict for run in runs), key=SEVERITY.index)
    guilty: list[tuple[ReportedRun, Judgement | None]] = []
    for run in runs:
        if run.verdict == worst:
            guilty += [(run, item) for item in run.judgements] or [(run, None)]
    run, judgement = _furthest(guilty)
    place = at_point(run.parameters)
    limit = judgement.limit.value if judgement else ""
    if worst == Verdict.AGREES:
        return "", limit
    if worst == Verdict.INCOMPLETE:
        return f"agrees, but does not report {', '.join(run.missing)}", limit
    if worst == Verdict.REFUSED:  # the verdict already names a refusal
        return f"{place.strip()}: {run.message}" if place else run.message, ""
    if judgement is None or worst == Verdict.FAILED:
        return f"{run.status}{place}: {run.message}", ""
    return f"{judgement.observable}{place}: {judgement.reason}", limit


def _remarks(runs: list[ReportedRun]) -> list[str]:
    """Remarks on a row: shared equations; those of the observable with the worst limit; a floor of precision."""
    remarks = list(dict.fromkeys(run.shared for run in runs if run.shared))
    shown = [(run, item) for run in runs for item in run.judgements if item.remarks]
    if shown:
        run, item = max(shown, key=lambda pair: (pair[1].limit_error or 0.0) / pair[1].tolerance)
        place = at_point(run.parameters)
        remarks += [f"{item.observable}{place}: {remark}" for remark in item.remarks]
    # with other verdicts the reason names the floor
    floors = [(run, item) for run in runs for item in run.judgements if item.floor and item.verdict is Verdict.AGREES]
    if floors:
        run, item = max(floors, key=lambda pair: pair[1].of_allowed)
        remarks.append(f"{item.observable}{at_point(run.parameters)}: {item.floor}")
    return remarks


def _furthest(judged: list[tuple[ReportedRun, Judgement | None]]) -> tuple[ReportedRun, Judgement | None]:
    """Run and judgement with the worst verdict, of equal ones the one furthest beyond its tolerance."""
    return max(judged, key=lambda pair: _severity(pair[1]) if pair[1] else (-1, 0.0))


def _worst(runs: list[ReportedRun], name: str) -> WorstJudgement:
    judged = [(run, next((item for item in run.judgements if item.observable == name), None)) for run in runs]
    worst_run, worst = _furthest(judged)
    assert worst is not None  # names are those of judged observables
    largest = max(judgement.error for _, judgement in judged if judgement is not None)
    values = {item.name: getattr(worst, item.name) for item in dataclasses.fields(worst)}
    return WorstJudgement(**values, point=worst_run.point, largest=largest)


def facts_of(run: Run) -> EngineFacts:
    """Facts of a run's engine; of one that is missing, its name alone."""
    return run.facts or EngineFacts(run.row.engine.partition("[")[0], version="", code="", settings={})


def _run(run: Run, row: int, until: float) -> ReportedRun:
    facts, result = facts_of(run), run.result
    made = ReportedRun(
        engine=run.row.engine,
        name=shown_name(facts.name),
        formulation=facts.settings.get("formulation"),
        preset=facts.settings.get("preset"),
        setting=setting_words(run.row.engine, facts),
        resolution=facts.resolution,
        resolution_value=facts.settings.get(facts.resolution or ""),
        declared_order=facts.order,
        caveat=facts.caveat,
        family=facts.family,
        precision=facts.precision,
        scheme=facts.scheme,
        witness=facts.witness,
        row=row,
        settings=facts.settings,
        point=point_name(run.parameters),
        parameters=run.parameters,
        status=result.status,
        message=result.message,
        verdict=run.verdict,
        reason="",
        limit="",
        contradictions=run.contradictions,
        missing=run.missing,
        shared=run.shared,
        diagnosis=run.diagnosis,
        judgements=run.judgements,
        certificate=result.certificate,
        seconds_per_second=result.seconds_per_second,
        rough_cost=rough_cost(result, until),
        build_seconds=result.build_seconds,
        timings=result.timings,
        cost=clean_cost(result),
        versions=result.versions,
        trajectory=result.trajectory,
        host=result.host,
        coarser=_coarser(run, facts),
    )
    reason, limit = _why([made])
    return dataclasses.replace(made, reason=reason, limit=limit)


def _coarser(run: Run, facts: EngineFacts) -> CoarserSteps:
    """Result of the coarser steps of a run's ladder."""
    own_value = facts.settings.get(facts.resolution or "")
    allowed = {item.observable: item.tolerance for item in run.judgements}
    rungs = [rung for rung in run.rungs if own_value is not None and rung.value > own_value]
    held = [
        rung.errors.keys() == allowed.keys() and all(rung.errors[name] <= allowed[name] for name in allowed)
        for rung in rungs
    ]
    if not held:
        return CoarserSteps.NOT_RUN
    return CoarserSteps.HELD if all(held) else CoarserSteps.FAILED
