"""Records of a comparison (:mod:`proofroll.report.comparison.records`), made from its outcome."""

import dataclasses
from typing import Any

from proofroll.core.comparison import Comparison
from proofroll.core.element_abilities import step_bound
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.verdict import Judgement, Verdict
from proofroll.files.trajectory_file import StoredTrajectory
from proofroll.report.comparison.records import (
    CauseAt,
    Claims,
    Cost,
    ReportedComparison,
    ReportedRow,
    ReportedRun,
    ShownBand,
    ShownObservable,
    WorstJudgement,
    in_words,
    rough_cost,
)
from proofroll.report.comparison.spread import spread_of
from proofroll.report.kinds import group_of, kind_name
from proofroll.report.labels import setting_words
from proofroll.running.case import EngineFacts, Status, hosts
from proofroll.running.environments import shown_name
from proofroll.studies.comparison.outcome import SEVERITY, Outcome, Run
from proofroll.studies.comparison.planning import at_point, point_name


def reported_rows(outcome: Outcome) -> list[ReportedRow]:
    """Summary of each row of a comparison."""
    return [_row(runs, outcome.comparison.until) for runs in outcome.rows]


def outcome_content(outcome: Outcome) -> ReportedComparison:
    """Content of a comparison's section in a report."""
    comparison = outcome.comparison
    scene = next((point.scene for point in outcome.points.values()), outcome.scene)
    steps = {run.facts.step for run in outcome.runs if run.facts is not None and run.facts.step is not None}
    return ReportedComparison(
        name=comparison.name,
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
        tolerances={
            name: ShownBand(band.because, {key: in_words(bound) for key, bound in band.bounds.items()})
            for name, band in comparison.bands.items()
        },
        rows=reported_rows(outcome),
        runs=[_run(run, number, comparison.until) for number, runs in enumerate(outcome.rows) for run in runs],
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
        budget=comparison.budget,
        beyond_budget=outcome.beyond_budget,
        truth_ends=[*_truth_ends(outcome), *([outcome.no_contact] if outcome.no_contact else [])],
        step_bound=step_bound(scene.elements, steps),
        omitted=list(scene.omitted),
        unfit=comparison.unfit,
        unjudged=[] if comparison.budget is None else _unjudged(scene, comparison),
    )


def _unjudged(scene: Scene, comparison: Comparison) -> list[str]:
    """Reactions of a scene, with ``*`` for the parts of its mechanism, that no tolerance of a comparison judges."""
    bounds = {name for band in comparison.bands.values() for name in band.bounds}
    names = [
        f"{name.partition('.')[0]}.*" if "." in name else name
        for name, item in scene.observables.items()
        if item.role is Role.REACTION and item.unit != "1" and name not in bounds and not item.absent
    ]
    return list(dict.fromkeys(names))


def _truth_ends(outcome: Outcome) -> list[str]:
    """Sentences about truths that end early, one for each point of the parameters with such a truth."""
    truths = {name: point.reference for name, point in outcome.points.items() if point.reference is not None}
    return [
        f"Not judged behind the end of the truth{at_point(outcome.points[name].case.parameters)}: {reference.ended}."
        for name, reference in truths.items()
        if reference.ended
    ]


def runs_at(outcome: Outcome, point: str) -> list[tuple[int, Run, StoredTrajectory]]:
    """Row number, run and trajectory of every run at a point, if it has a trajectory."""
    return [
        (number, run, run.trajectory)
        for number, runs in enumerate(outcome.rows)
        for run in runs
        if point_name(run.parameters) == point and run.trajectory is not None
    ]


def _row(runs: list[Run], until: float) -> ReportedRow:
    """Summary of a row over the points of the parameters, by the worst verdict and the largest cost."""
    run_1 = runs[0]
    # A point where the question is ill-posed or not judged does not count against an engine.
    judged = [run for run in runs if run.verdict not in {Verdict.ILL_POSED, Verdict.NOT_JUDGED}] or runs
    names = list(dict.fromkeys(judgement.observable for run in judged for judgement in run.judgements))
    timings = [run.result.seconds_per_second for run in runs if run.result.seconds_per_second is not None]
    rough = [cost for run in runs if (cost := rough_cost(run.result, until)) is not None]
    reason, limit = _why(judged)
    return ReportedRow(
        **settings_of(run_1),
        verdict=max((run.verdict for run in judged), key=SEVERITY.index),
        verdicts={verdict.value: sum(run.verdict == verdict for run in runs) for verdict in Verdict},
        reason=reason,
        limit=limit,
        shared=next((run.shared for run in runs if run.shared), ""),
        missing=sorted({name for run in runs for name in run.missing}),
        remarks=_remarks(runs),
        diagnosis=_diagnosis(runs),
        expected=run_1.row.expect,
        expected_for=run_1.row.expect_for,
        because=run_1.row.because,
        short=run_1.row.short,
        tolerance=run_1.row.tolerance,
        claims=Claims.of(run_1.row),
        as_expected=not any(run.contradictions for run in runs),
        observables={name: _worst(judged, name) for name in names},
        seconds_per_second=max(timings, default=None),
        rough_cost=max(rough, default=None),
        message=next((run.result.message for run in runs if run.result.status != Status.DONE), ""),
    )


def _why(runs: list[Run]) -> tuple[str, str]:
    """Reason of the worst verdict, empty if everything agrees; and the result of its ladder of steps, ``limit``."""
    worst = max((run.verdict for run in runs), key=SEVERITY.index)
    guilty: list[tuple[Run, Judgement | None]] = []
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
        return f"{place.strip()}: {run.result.message}" if place else run.result.message, ""
    if judgement is None or worst == Verdict.FAILED:
        return f"{run.result.status}{place}: {run.result.message}", ""
    return f"{judgement.observable}{place}: {judgement.reason}", limit


def _remarks(runs: list[Run]) -> list[str]:
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
        run, item = max(floors, key=lambda pair: pair[1].error / pair[1].tolerance)
        remarks.append(f"{item.observable}{at_point(run.parameters)}: {item.floor}")
    return remarks


def _diagnosis(runs: list[Run]) -> list[CauseAt]:
    """Proven causes, each once, with the points where it was proven."""
    causes: dict[str, CauseAt] = {}
    for run in runs:
        for item in run.diagnosis:
            causes.setdefault(item.cause.id, CauseAt(item, [])).points.append(point_name(run.parameters))
    return list(causes.values())


def _furthest(judged: list[tuple[Run, Judgement | None]]) -> tuple[Run, Judgement | None]:
    """Run and judgement with the worst verdict, of equal ones the one furthest beyond its tolerance."""

    def badness(pair: tuple[Run, Judgement | None]) -> tuple[int, float]:
        item = pair[1]
        return (SEVERITY.index(item.verdict), item.error / item.tolerance) if item else (-1, 0.0)

    return max(judged, key=badness)


def _worst(runs: list[Run], name: str) -> WorstJudgement:
    judged = [(run, next((item for item in run.judgements if item.observable == name), None)) for run in runs]
    worst_run, worst = _furthest(judged)
    assert worst is not None  # names are those of judged observables
    largest = max(judgement.error for _, judgement in judged if judgement is not None)
    values = {item.name: getattr(worst, item.name) for item in dataclasses.fields(worst)}
    return WorstJudgement(**values, point=point_name(worst_run.parameters), largest=largest)


def facts_of(run: Run) -> EngineFacts:
    """Facts of a run's engine; of one that is missing, its name alone."""
    return run.facts or EngineFacts(run.row.engine.partition("[")[0], version="", code="", settings={})


def settings_of(run: Run) -> dict[str, Any]:
    """Values of the fields of :class:`Setting`."""
    facts = facts_of(run)
    return {
        "engine": run.row.engine,
        "name": shown_name(facts.name),
        "formulation": facts.settings.get("formulation"),
        "preset": facts.settings.get("preset"),
        "setting": setting_words(run.row.engine, facts),
        "resolution": facts.resolution,
        "resolution_value": facts.settings.get(facts.resolution or ""),
        "declared_order": facts.order,
        "caveat": facts.caveat,
        "family": facts.family,
        "precision": facts.precision,
        "scheme": facts.scheme,
    }


def _run(run: Run, row: int, until: float) -> ReportedRun:
    reason, limit = _why([run])
    return ReportedRun(
        row=row,
        **settings_of(run),
        settings=run.facts.settings if run.facts else {},
        point=point_name(run.parameters),
        parameters=run.parameters,
        status=run.result.status,
        message=run.result.message,
        verdict=run.verdict,
        reason=reason,
        limit=limit,
        contradictions=run.contradictions,
        missing=run.missing,
        shared=run.shared,
        diagnosis=run.diagnosis,
        judgements=run.judgements,
        certificate=run.result.certificate,
        seconds_per_second=run.result.seconds_per_second,
        rough_cost=rough_cost(run.result, until),
        build_seconds=run.result.build_seconds,
        timings=run.result.timings,
        cost=Cost.of(run.result.timings),
        versions=run.result.versions,
        trajectory=run.result.trajectory,
        host=run.result.host,
    )
