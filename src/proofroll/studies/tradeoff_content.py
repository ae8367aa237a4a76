"""What a trade-off study found, as plain data: printed by ``--json``, stored, and answered from."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.observable import Role
from proofroll.files.json_data import plain
from proofroll.running.case import Status
from proofroll.running.timing import Timing
from proofroll.studies import study_identity
from proofroll.studies.budget import Budget, budget, sentence
from proofroll.studies.curve import Curve, CurvePoint
from proofroll.studies.hosts import hosts, said_of
from proofroll.studies.pareto import envelope, front
from proofroll.studies.recommend import by_hand
from proofroll.studies.sweep import BROKEN
from proofroll.studies.tradeoff import Tradeoff, judged_quantities, pareto_entries


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


def tradeoff_document(found: Tradeoff) -> dict[str, Any]:
    """Everything as plain data: what ``--json`` prints, what is stored, and what a recommendation is made from."""
    reference, known = found.reference, found.reference.scene.observables
    numbers = {point.case.key: number for number, point in enumerate(found.points)}
    made = budgets(found)
    quantities = {
        name: {
            "unit": known[name].unit,
            "scale": reference.scale(name),
            "truth_error_bar": reference.true(name, curve)[1],
        }
        for name, curve in reference.curves.items()
    }
    document = {
        "study": "tradeoff",
        "scene": found.question.scene,
        "parameters": found.question.parameters,
        "until": found.question.until,
        "every": found.question.every,
        "quantity": found.question.quantity,
        "quantities": quantities,
        "points": [
            _point(curve, point, numbers[point.case.key], held, found)
            for curve in found.curves
            for point, held in zip(curve.points, _envelopes(curve, quantities), strict=True)
        ],
        "dropped": [
            {"engine": curve.engine, "step": step, "reason": reason}
            for curve in found.curves
            for step, reason in curve.dropped.items()
        ],
        "absent": found.absent,
        "budgets": [_budget(curve, entry, known[entry.quantity].unit) for curve, entry in made],
        "pareto": _fronts(found.curves, numbers, found),
        "pareto_engines": _fronts([curve for curve in found.curves if not by_hand(curve.level)], numbers, found),
        "truth": {**_cost(found.truth_timing), "route": reference.dataset.attrs.get("route", "")},
        "over": found.over,
        "findings": findings(found, made),
        "brief": found.brief,
        "measured": study_identity.measured(),
    }
    return dict(plain(document))


def _fronts(curves: Sequence[Curve], numbers: dict[str, int], found: Tradeoff) -> dict[str, list[int]]:
    """For every observable the points that nothing beats, cheapest first."""
    return {
        name: [numbers[point.case.key] for point in front(pareto_entries(curves, name, found.timings))]
        for name in judged_quantities(found)
    }


def _envelopes(curve: Curve, quantities: Iterable[str]) -> list[dict[str, float]]:
    by_name = {name: envelope([p.errors.get(name, np.inf) for p in curve.points]) for name in quantities}
    return [{name: held[index] for name, held in by_name.items()} for index in range(len(curve.points))]


def _point(curve: Curve, point: CurvePoint, number: int, held: dict[str, float], found: Tradeoff) -> dict[str, Any]:
    timing = found.timings.get(point.case.key)
    corners = found.corners.get(point.case.key)
    facts = point.case.engine
    return {
        "id": number,
        "engine": facts.name,
        "curve": curve.engine,
        "level": curve.level,
        "settings": facts.settings,
        "resolution": facts.resolution,
        "step": point.step,
        "order": facts.order,
        "caveat": facts.caveat,
        "status": point.result.status,
        "message": point.result.message,
        "host": point.result.host,
        "error": point.errors,
        "envelope": {name: value for name, value in held.items() if name in point.errors},
        "sparse": None
        if point.sparse is None
        else {
            "every": point.sparse.case.every,
            "error": point.sparse.errors,
            "dense_error": point.dense,
            "message": point.sparse.result.message,
        },
        **_cost(timing),
        "corners": [dataclasses.asdict(corner) for corner in corners] if corners is not None else None,
    }


def _cost(timing: Timing | None) -> dict[str, Any]:
    """Median of wall seconds per simulated second, its interval and confidence, and the rounds; None: not measured.

    The rounds are those of all points, so that a ratio of two can be taken round by round. A single measurement has no
    interval.
    """
    found = timing.interval if timing else None
    return {
        "seconds_per_second": found.value if found else None,
        "interval": [found.low, found.high] if found and found.confidence else None,
        "confidence": found.confidence if found else None,
        "rounds": list(timing.values) if timing else [],
        "measurements": len(timing.values) if timing else 0,
    }


def _budget(curve: Curve, found: Budget, unit: str) -> dict[str, Any]:
    return {
        "engine": curve.facts.name,
        "curve": curve.engine,
        **dataclasses.asdict(found),
        "contradicts_declaration": found.contradicts_declaration,
        "sentence": sentence(found, unit, str(curve.facts.resolution)),
    }


def findings(found: Tradeoff, made: Sequence[tuple[Curve, Budget]]) -> list[str]:
    """What stands out, as sentences."""
    said = said_of(hosts(point.result for point in found.points))
    quantity = found.question.quantity
    scale, unit = found.reference.scale(quantity) or 1.0, found.reference.scene.observables[quantity].unit
    judged = judged_quantities(found)
    for curve in found.curves:
        other = [i for of, i in made if of is curve and i.quantity in judged and i.contradicts_declaration]
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
