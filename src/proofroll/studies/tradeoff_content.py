"""What is kept of a trade-off: its points, error budgets, fronts and findings."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.observable import Role
from proofroll.files.json_data import plain, record
from proofroll.running.case import Status
from proofroll.running.timing import Timing
from proofroll.studies.budget import Budget, budget, sentence
from proofroll.studies.curve import Curve, CurvePoint
from proofroll.studies.hosts import hosts, said_of
from proofroll.studies.pareto import envelope, front
from proofroll.studies.recommend import by_hand
from proofroll.studies.study_identity import measured
from proofroll.studies.sweep import BROKEN
from proofroll.studies.tradeoff import Tradeoff, judged_quantities, pareto_entries
from proofroll.studies.tradeoff_records import (
    CurveBudget,
    DroppedStep,
    MeasuredPoint,
    MeasuredQuantity,
    SparseRun,
    TradeoffStudy,
    TruthCost,
)


def budgets(found: Tradeoff) -> list[tuple[Curve, Budget]]:
    """The error budget of every curve for every quantity that it has."""
    every = found.question.every
    made = []
    for curve in found.curves:
        for quantity in found.quantities:
            shown = [point.curves[quantity] for point in curve.points if quantity in point.curves]
            declared = found.reference.scene.observables[quantity]
            if not shown or (declared.role == Role.EVENT and not declared.asked_for):
                continue
            true: FloatArray = found.reference.true(quantity, shown[-1])[0]
            if all(values.shape == true.shape for p in curve.points if p.case.every == every
                   for values in [p.curves.get(quantity)] if values is not None):  # fmt: skip
                made.append((curve, budget(curve, quantity, every, true)))
    return made


def tradeoff_study(found: Tradeoff) -> TradeoffStudy:
    """What is kept of it, as it will be read: numbers that are not finite are None."""
    reference, known = found.reference, found.reference.scene.observables
    numbers = {point.case.key: number for number, point in enumerate(found.points)}
    made = budgets(found)
    quantities = {
        name: MeasuredQuantity(known[name].unit, reference.scale(name), reference.true(name, curve)[1])
        for name, curve in reference.curves.items()
    }
    study = TradeoffStudy(
        scene=found.question.scene,
        parameters=found.question.parameters,
        until=found.question.until,
        every=found.question.every,
        quantity=found.question.quantity,
        quantities=quantities,
        points=[
            _point(curve, point, numbers[point.case.key], held, found)
            for curve in found.curves
            for point, held in zip(curve.points, _envelopes(curve, quantities), strict=True)
        ],
        dropped=[
            DroppedStep(curve.engine, step, reason) for curve in found.curves for step, reason in curve.dropped.items()
        ],
        absent=found.absent,
        budgets=[_budget(curve, entry, known[entry.quantity].unit) for curve, entry in made],
        pareto=_fronts(found.curves, numbers, found),
        pareto_engines=_fronts([curve for curve in found.curves if not by_hand(curve.level)], numbers, found),
        truth=TruthCost(**_cost(found.truth_timing), route=reference.dataset.attrs.get("route", "")),
        over=found.over,
        findings=findings(found, made),
        brief=found.brief,
        measured=measured(),
    )
    return record(TradeoffStudy, plain(study))


def _fronts(curves: Sequence[Curve], numbers: dict[str, int], found: Tradeoff) -> dict[str, list[int]]:
    """For every observable the points that nothing beats, cheapest first."""
    return {
        name: [numbers[point.case.key] for point in front(pareto_entries(curves, name, found.timings))]
        for name in judged_quantities(found)
    }


def _envelopes(curve: Curve, quantities: Iterable[str]) -> list[dict[str, float]]:
    by_name = {name: envelope([p.errors.get(name, np.inf) for p in curve.points]) for name in quantities}
    return [{name: held[index] for name, held in by_name.items()} for index in range(len(curve.points))]


def _point(curve: Curve, point: CurvePoint, number: int, held: dict[str, float], found: Tradeoff) -> MeasuredPoint:
    facts, few = point.case.engine, point.sparse
    return MeasuredPoint(
        **_cost(found.timings.get(point.case.key)),
        id=number,
        engine=facts.name,
        curve=curve.engine,
        level=curve.level,
        settings=facts.settings,
        resolution=facts.resolution,
        step=point.step,
        order=facts.order,
        caveat=facts.caveat,
        status=point.result.status,
        message=point.result.message,
        host=point.result.host,
        error={**point.errors},
        envelope={name: value for name, value in held.items() if name in point.errors},
        sparse=SparseRun(few.case.every, {**few.errors}, {**point.dense}, few.result.message) if few else None,
        corners=found.corners.get(point.case.key),
    )


def _cost(timing: Timing | None) -> dict[str, Any]:
    """The fields of :class:`~proofroll.studies.tradeoff_records.MeasuredCost`."""
    if timing is None:
        return {}
    found = timing.interval
    return {
        "seconds_per_second": found.value,
        "interval": (found.low, found.high) if found.confidence else None,
        "confidence": found.confidence,
        "rounds": list(timing.values),
        "measurements": len(timing.values),
    }


def _budget(curve: Curve, found: Budget, unit: str) -> CurveBudget:
    return CurveBudget(
        **dataclasses.asdict(found),
        engine=curve.facts.name,
        curve=curve.engine,
        contradicts_declaration=found.contradicted,
        sentence=sentence(found, unit, str(curve.facts.resolution)),
    )


def findings(found: Tradeoff, made: Sequence[tuple[Curve, Budget]]) -> list[str]:
    """What stands out, as sentences."""
    said = said_of(hosts(point.result for point in found.points))
    quantity = found.question.quantity
    scale, unit = found.reference.scale(quantity) or 1.0, found.reference.scene.observables[quantity].unit
    judged = judged_quantities(found)
    for curve in found.curves:
        other = [i for of, i in made if of is curve and i.quantity in judged and i.contradicted]
        if other:
            shown = ", ".join(f"{i.quantity} {i.order:.2f} ({i.order_low:.2f} to {i.order_high:.2f})" for i in other)
            said.append(f"{curve.engine} declares order {other[0].declared}, but there show: {shown}.")
    whole = [
        c for c in found.curves if c.saturated(quantity) and c.points[0].errors.get(quantity, np.inf) < BROKEN * scale
    ]
    if whole:
        names = ", ".join(curve.engine for curve in whole)
        said.append(f"No tolerance breaks {names}, sampled every {found.question.sparse:g} s either.")
    done = [point for point in found.points if point.result.status == Status.DONE]
    broken = [point for point in done if not point.errors.get(quantity, np.inf) < BROKEN * scale]
    refused = sum(point.result.status == Status.REFUSED for point in found.points)
    ended = len(found.points) - len(done) - refused
    said.append(
        f"{len(found.points)} runs: {refused} refused, {ended} that did not reach the end, all with a reason; "
        f"{len(broken)} that reached it silently with {quantity} off by more than {BROKEN * scale:.2g} {unit}."
    )
    return said
