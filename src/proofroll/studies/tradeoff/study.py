"""Summary of a trade-off for storage: points, error budgets, Pareto fronts and conclusions."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.core.convergence import floor_text
from proofroll.core.engine_abilities import by_hand
from proofroll.core.number_format import counted, number, spaced
from proofroll.core.observable import Role
from proofroll.files.json_data import plain, record
from proofroll.running.case import Status, host_sentences, hosts
from proofroll.running.runner import Runner
from proofroll.running.time_budget import TimeBudget
from proofroll.running.timing import Timing, write_benchmarks
from proofroll.studies.claim_judgement import JudgedFile
from proofroll.studies.study_store import conditions_now, keep_study
from proofroll.studies.tradeoff.claims import TradeoffClaims
from proofroll.studies.tradeoff.curve import Curve, CurvePoint, Question
from proofroll.studies.tradeoff.error_budget import budget
from proofroll.studies.tradeoff.pareto import front
from proofroll.studies.tradeoff.records import (
    CurveBudget,
    DroppedStep,
    MeasuredPoint,
    MeasuredQuantity,
    SparseRun,
    TradeoffStudy,
    TruthCost,
)
from proofroll.studies.tradeoff.sweep import BROKEN, too_long
from proofroll.studies.tradeoff.tradeoff import (
    BRIEF_LONGEST,
    Extent,
    Progress,
    Tradeoff,
    pareto_entries,
    study_path,
    tradeoff,
)


def make_tradeoff(
    question: Question,
    runner: Runner,
    folder: Path,
    extent: Extent,
    claims: TradeoffClaims | None = None,
    progress: Progress | None = None,
) -> tuple[TradeoffStudy, Path]:
    """Measures a trade-off (:func:`tradeoff`), and stores it with all its timings in pyperf's format.

    Claims are judged unless the study is restricted to some engines; a brief study refines claimed curves further.

    Args:
        question: of the sweep.
        runner: runs the cases.
        folder: of all results.
        extent: engines, range of parameters, and thoroughness.
        claims: of a file, or None.
        progress: see :class:`~proofroll.studies.tradeoff.tradeoff.StudyProgress`.

    Returns:
        The study with its judged claims, and its file.

    Raises:
        InputError: an unknown scene, parameter, quantity or engine.
        ProofrollError: there is no truth, or the folder cannot be written.
    """
    claimed = [item.engine for kind in (claims.holds, claims.converges) for item in kind] if claims else []
    outcome = tradeoff(question, runner, dataclasses.replace(extent, claimed=claimed), progress)
    study = tradeoff_study(outcome)
    judged = claims if not extent.engines else None
    judgement = JudgedFile(
        claims.name if claims else None,
        judged.contradictions(study) if judged else [],
        judged.undecided(study) if judged else [],
    )
    study = dataclasses.replace(study, engines=sorted(extent.engines), claims=judgement)
    path = study_path(folder, question, extent.engines, brief=extent.is_brief)
    keep_study(study, path)
    timings = {
        f"{curve.engine} {point.step or ''}".strip(): point.timing
        for curve in outcome.curves
        for point in curve.points
        if point.timing is not None
    }
    write_benchmarks(timings, path.with_suffix(".pyperf.json"))
    return study, path


def tradeoff_study(outcome: Tradeoff) -> TradeoffStudy:
    """Record of a trade-off; numbers that are not finite become None."""
    question, reference, observables = outcome.question, outcome.reference, outcome.reference.scene.observables
    numbers = {point.case.key: number for number, point in enumerate(outcome.points)}
    budgets = _budgets(outcome)
    study = TradeoffStudy(
        scene=question.scene,
        parameters=question.parameters,
        until=question.until,
        every=question.every,
        quantity=question.quantity,
        quantities={
            name: MeasuredQuantity(
                unit=observables[name].unit,
                scale=reference.scale(name),
                truth_error_bar=reference.true(name, curve).error_bar,
                symbol=observables[name].shown
                + name.removeprefix(observables[name].name),  # with the element, where there are several
                column=observables[name].column,
            )
            for name, curve in reference.curves.items()
        },
        points=[point for curve in outcome.curves for point in _points(curve, list(reference.curves), numbers)],
        dropped=[
            DroppedStep(curve.engine, step, reason)
            for curve in outcome.curves
            for step, reason in curve.dropped.items()
        ],
        absent=outcome.absent,
        budgets=budgets,
        pareto=_fronts(outcome, outcome.curves, numbers),
        pareto_engines=_fronts(outcome, [curve for curve in outcome.curves if not by_hand(curve.facts.level)], numbers),
        truth=TruthCost(**_cost(outcome.truth_timing), route=reference.dataset.attrs.get("route", "")),
        over={name: [float(value) for value in values] for name, values in outcome.extent.over.items()},
        findings=_conclusions(outcome, budgets),
        brief=outcome.extent.is_brief,
        measured=conditions_now(),
    )
    return record(TradeoffStudy, plain(study))


def _budgets(outcome: Tradeoff) -> list[CurveBudget]:
    """Error budget of every curve for each of its quantities."""
    every, made = outcome.question.every, []
    for curve in outcome.curves:
        for quantity in outcome.reference.curves:
            shown = [(point, point.curves[quantity]) for point in curve.points if quantity in point.curves]
            declared = outcome.reference.scene.observables[quantity]
            if not shown or (declared.role == Role.EVENT and not declared.asked_for):
                continue
            true = outcome.reference.true(quantity, shown[-1][1]).values
            if all(values.shape == true.shape for point, values in shown if point.case.every == every):
                made.append(budget(curve, quantity, every, true, declared, outcome.reference.magnitude(quantity)))
    return made


def _fronts(outcome: Tradeoff, curves: Sequence[Curve], numbers: Mapping[str, int]) -> dict[str, list[int]]:
    """Pareto front of every observable, cheapest first."""
    return {
        name: [numbers[point.case.key] for point in front(pareto_entries(curves, name))] for name in outcome.quantities
    }


def _points(curve: Curve, quantities: Sequence[str], numbers: Mapping[str, int]) -> list[MeasuredPoint]:
    envelopes = {name: curve.envelope(name) for name in quantities}
    points = []
    for index, point in enumerate(curve.points):
        bounds = {name: errors[index] for name, errors in envelopes.items() if name in point.errors}
        points.append(_point(curve, point, numbers[point.case.key], bounds))
    return points


def _point(curve: Curve, point: CurvePoint, number: int, envelope: dict[str, float]) -> MeasuredPoint:
    facts, few = point.case.engine, point.sparse
    return MeasuredPoint(
        **_cost(point.timing),
        **curve.setting(facts),
        id=number,
        step=point.step,
        order=facts.order,
        status=point.result.status,
        message=point.result.message,
        host=point.result.host,
        error={**point.errors},
        envelope={**envelope},
        sparse=SparseRun(few.case.every, {**few.errors}, {**point.dense}, few.result.message) if few else None,
        corners=point.corners,
    )


def _cost(timing: Timing | None) -> dict[str, Any]:
    """Fields of :class:`~proofroll.studies.tradeoff.records.MeasuredCost`."""
    if timing is None:
        return {}
    interval = timing.interval
    return {
        "seconds_per_second": interval.value,
        "interval": (interval.low, interval.high) if interval.confidence else None,
        "confidence": interval.confidence,
        "rounds": list(timing.values),
        "measurements": len(timing.values),
    }


def _conclusions(outcome: Tradeoff, budgets: Sequence[CurveBudget]) -> list[str]:
    """Conclusions of the study, as sentences."""
    sentences = host_sentences(hosts(point.result for point in outcome.points))
    quantity = outcome.question.quantity
    scale, unit = outcome.reference.scale(quantity) or 1.0, outcome.reference.scene.observables[quantity].unit
    judged = [item for item in budgets if item.quantity in outcome.quantities and item.contradicts_declaration]
    for curve in outcome.curves:
        if misjudged := [item for item in judged if item.curve == curve.engine]:
            shown = ", ".join(
                f"{i.quantity} {i.order:.2f} ({i.order_low:.2f} to {i.order_high:.2f})" for i in misjudged
            )
            sentences.append(f"{curve.engine} declares order {misjudged[0].declared}, but there show: {shown}.")
    for item in budgets:
        if item.quantity == quantity and item.best_step is not None and item.floor is not None:
            floor = floor_text(item.best_step, item.floor, unit)
            sentences.append(f"{item.curve}, {quantity}: {floor}; smaller steps are worse.")
    whole = [
        c for c in outcome.curves if c.saturated(quantity) and c.points[0].errors.get(quantity, np.inf) < BROKEN * scale
    ]
    if whole:
        names = ", ".join(curve.engine for curve in whole)
        sentences.append(f"No tolerance breaks {names}, sampled every {outcome.question.sparse:g} s either.")
    done = [point for point in outcome.points if point.result.status == Status.DONE]
    broken = [point for point in done if not point.errors.get(quantity, np.inf) < BROKEN * scale]
    for reason in (TimeBudget(outcome.extent.budget or 0.0).sentence, too_long(BRIEF_LONGEST)):
        beyond = [
            f"{curve.engine} from {max(dropped):g} on"
            for curve in outcome.curves
            if (dropped := [step for step, why in curve.dropped.items() if why == reason])
        ]
        if beyond:
            sentences.append(f"Left out, for {reason}: {', '.join(beyond)}.")
    refused = sum(point.result.status == Status.REFUSED for point in outcome.points)
    wrong = sum(point.result.status == Status.WRONG_MODEL for point in outcome.points)
    ended = len(outcome.points) - len(done) - refused - wrong
    built = f"{wrong} of a wrong model, " if wrong else ""
    sentences.append(
        f"{counted(len(outcome.points), 'runs')}: {refused} refused, {built}{ended} that did not reach the end, "
        f"all with a reason; {len(broken)} that reached it silently "
        f"with {quantity} off by more than {number(BROKEN * scale)}{spaced(unit)}."
    )
    return sentences
