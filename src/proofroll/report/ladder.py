"""What ``proofroll ladder`` says: as plain data, as two tables, and in sentences."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

from rich.table import Table
from rich.text import Text

from proofroll.core.arrays import largest_difference
from proofroll.core.dataset import scales
from proofroll.core.errors import ProofrollError
from proofroll.report.labels import number
from proofroll.report.terminal import step
from proofroll.running.case import EngineDescription, Status
from proofroll.running.timing import Interval, machine, ratio
from proofroll.studies.ladder import Ladder, absence, key_of
from proofroll.studies.ladder_models import LadderModel, Rung, Switch
from proofroll.studies.term_worth import Side, Worth, worth

_SHORT = {Worth.NOT_NEEDED: "not needed"}
_STYLES = {Worth.NEEDED: "green", Worth.NOT_NEEDED: "yellow", Worth.HARMFUL: "red", Worth.NO_ANSWER: "bold red"}
_OF_A_RUNG = ("engine", "formulation", "preset", "settings", "resolution", "resolution_value", "error")


def ladder_content(study: Ladder) -> dict[str, Any]:
    """The study as plain data; what does not exist is None.

    ``rungs``: ``level``, ``engine``, ``formulation``, ``preset``, ``variant``, ``settings``, ``resolution`` (name),
    ``resolution_value``, ``status``, ``message``, ``error`` (in ``unit``), ``seconds_per_second`` (``value``, ``low``,
    ``high``); ``status`` is ``empty`` where no engine has a model of the level.

    ``terms``: ``term``, ``kind`` (``scene`` or ``engine``), ``engine``, ``formulation``, ``because``, ``on`` and
    ``off`` (each ``settings``, ``parameters``, ``asks``, ``status``, ``message``, ``error``, ``seconds_per_second``),
    ``cost`` (how many times longer with it: ``value``, ``low``, ``high``), ``change`` of the quantity when it is left
    out, ``error_change`` (error without less error with), ``verdict`` and ``reason``. The truth of a term is the scene
    with it.

    ``findings``: sentences. Besides these the question (``scene``, ``parameters``, ``quantity``, ``unit``, ``scale``,
    ``tolerance``, ``until``), ``truth``, ``absent`` engines, ``unplaced`` ones that tell no levels, and ``machine``.
    """
    truth = study.truths[str({})]
    content: dict[str, Any] = {
        "scene": study.scene.name,
        "parameters": dict(study.scene.parameters),
        "quantity": study.quantity,
        "unit": study.unit,
        "scale": scales(study.scene, truth.dataset).get(study.quantity),
        "tolerance": study.tolerance,
        "until": study.until,
        "truth": {"route": truth.dataset.attrs.get("route"), "error_bar": truth.error_bar},
        "rungs": [_rung(study, rung) for rung in study.ladder],
        "terms": [_term(study, switch) for switch in study.switches],
        "absent": {
            name: {"status": absence(told).status.value, "message": str(told)}
            for name, told in study.engines.items()
            if isinstance(told, ProofrollError)
        },
        "unplaced": [
            name for name, told in study.engines.items() if isinstance(told, EngineDescription) and not told.levels
        ],
        "machine": machine(),
    }
    return content | {"findings": list(_findings(content))}


def _rung(study: Ladder, rung: Rung) -> dict[str, Any]:
    content: dict[str, Any] = {"level": rung.level.value, "variant": rung.variant}
    if rung.model is None:
        nothing = dict.fromkeys((*_OF_A_RUNG, "seconds_per_second"))
        return content | nothing | {"status": "empty", "message": rung.message}
    content |= {"engine": rung.model.engine, **{key: rung.model.options[key] for key in ("formulation", "preset")}}
    content |= _said(study, rung.model, {})
    case = study.answers[key_of(rung.model)].case
    resolution = case.engine.resolution if case else None
    value = case.engine.settings.get(resolution) if case and resolution else None
    return content | {"resolution": resolution, "resolution_value": value}


def _said(study: Ladder, model: LadderModel, point: dict[str, float]) -> dict[str, Any]:
    answer = study.answers[key_of(model)]
    message = answer.result.message
    if answer.result.status == Status.DONE and answer.values is None:
        message = f"the engine does not give {study.quantity}"
    return {
        "settings": answer.case.engine.settings if answer.case else None,
        "status": answer.result.status.value,
        "message": message,
        "error": study.error(model, point),
        "seconds_per_second": _interval(answer.timing.interval if answer.timing else None),
    }


def _term(study: Ladder, switch: Switch) -> dict[str, Any]:
    content: dict[str, Any] = {
        "term": switch.term,
        "kind": switch.kind,
        "engine": switch.model.engine,
        "formulation": switch.model.formulation,
        "because": switch.because,
    }
    if switch.on is None or switch.off is None:
        nothing = dict.fromkeys(("on", "off", "cost", "change", "error_change"))
        return content | nothing | {"verdict": Worth.INHERENT.value, "reason": f"cannot be left out: {switch.because}"}
    point = dict(switch.on.parameters)
    answers = on, off = study.answers[key_of(switch.on)], study.answers[key_of(switch.off)]
    with_it, without = study.error(switch.on, point), study.error(switch.off, point)
    change = largest_difference(on.values, off.values) if on.values is not None and off.values is not None else None
    cost = ratio(on.timing, off.timing) if on.timing and off.timing else None
    said = [f"{answer.result.status.value}, {answer.result.message}" for answer in answers]
    verdict, reason = worth(
        Side(with_it, said[0]),
        Side(without, said[1]),
        change,
        cost,
        tolerance=study.tolerance,
        bar=study.truths[str(point)].error_bar,
        scale=scales(study.scene, study.truths[str({})].dataset).get(study.quantity, 1.0),
    )
    return content | {
        **{
            side: {"parameters": dict(model.parameters), "asks": list(model.asks), **_said(study, model, point)}
            for side, model in (("on", switch.on), ("off", switch.off))
        },
        "cost": _interval(cost),
        "change": change,
        "error_change": None if with_it is None or without is None else without - with_it,
        "verdict": verdict.value,
        "reason": reason,
    }


def _interval(interval: Interval | None) -> dict[str, float] | None:
    return None if interval is None else dataclasses.asdict(interval)


def _findings(content: dict[str, Any]) -> Iterator[str]:
    """What to take home, in sentences."""
    name, unit = content["quantity"], content["unit"]
    empty = [rung["level"] for rung in content["rungs"] if rung["status"] == "empty"]
    if empty:
        yield f"No engine that was asked has a model of the level {', '.join(empty)}."
    # A rung that is off by the whole size of the quantity has no answer, however cheap.
    useful = [
        rung
        for rung in content["rungs"]
        if rung["error"] is not None and rung["seconds_per_second"] and rung["error"] < (content["scale"] or math.inf)
    ]
    if useful:
        said = "; ".join(f"{_label(rung)} ({rung['error']:.2g} {unit})" for rung in _front(useful))
        yield f"Nothing is both cheaper and nearer to the true {name} than, from the cheapest on: {said}."
    if content["tolerance"] is not None:
        yield _cheapest(useful, content["tolerance"], f"{content['tolerance']:g} {unit}")
    yield from _of_terms(content)
    for rung in content["rungs"]:
        if rung["status"] not in {"done", "empty"} and not rung["variant"]:  # those are among the terms
            yield f"{_label(rung)} {rung['status']}: {rung['message']}."
    for engine, told in content["absent"].items():
        yield f"{engine} is {told['status']}: {told['message']}."
    if content["unplaced"]:
        yield f"Not on the ladder, for they tell no levels: {', '.join(content['unplaced'])}."


def _cheapest(rungs: list[dict[str, Any]], tolerance: float, said: str) -> str:
    """The cheapest rung within a tolerance."""
    within = [rung for rung in rungs if rung["error"] <= tolerance]
    if not within:
        return f"No rung is within {said} at its own step."
    best = min(within, key=lambda rung: rung["seconds_per_second"]["value"])
    return f"The cheapest within {said} is {_label(best)} ({best['level']}), off by {best['error']:.2g}."


def _front(rungs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rungs that no other beats in both cost and error, cheapest first."""
    front: list[dict[str, Any]] = []
    for rung in sorted(rungs, key=lambda rung: (rung["seconds_per_second"]["value"], rung["error"])):
        if not front or rung["error"] < front[-1]["error"]:
            front.append(rung)
    return front


def _of_terms(content: dict[str, Any]) -> Iterator[str]:
    """One sentence per term and verdict, over all models."""
    name, unit = content["quantity"], content["unit"]
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for term in content["terms"]:
        groups.setdefault((term["term"], term["verdict"]), []).append(term)
    for (term, verdict), rows in groups.items():
        where = ", ".join(_label(row) for row in rows)
        largest = max((row["change"] for row in rows if row["change"] is not None), default=None)
        match verdict:
            case Worth.NEEDED if largest is not None:
                yield f"{term} is needed in {where}: leaving it out moves {name} by up to {largest:.2g} {unit}."
            case Worth.NEEDED:
                yield f"{term} is needed in {where}: {rows[0]['reason']}."
            case Worth.HARMFUL:
                yield f"{term} moves {name} away from the truth in {where}, by up to {largest:.2g} {unit}."
            case Worth.NOT_NEEDED:
                times = ", ".join(f"{_label(row)} ({row['cost']['value']:.2f}×)" for row in rows)
                yield f"{term} is paid for but not needed in {times}: {name} moves by {largest:.1g} {unit} at most."
            case Worth.INHERENT:
                yield f"{term}: it cannot be left out of {where}."
            case Worth.NO_ANSWER:
                yield f"{term}: {_label(rows[0])} {rows[0]['reason'].removeprefix('with it: ')}."


def _label(row: dict[str, Any]) -> str:
    return " ".join(filter(None, (row["engine"], row["formulation"], row.get("variant", ""))))


def rung_table(content: dict[str, Any]) -> Table:
    """One line per rung, from the least model to the most."""
    title = f"{content['quantity']} of {content['scene']} over {content['until']:g} s, from the least model to the most"
    table = Table(title=Text(title), title_justify="left", box=None, padding=(0, 1, 0, 0))
    for column in ("level", "engine formulation", "step"):
        table.add_column(column, no_wrap=True)
    for column in (f"error [{content['unit']}]", "s/s", "low … high"):
        table.add_column(Text(column), justify="right", no_wrap=True)
    for rung in content["rungs"]:
        speed = rung["seconds_per_second"]
        if rung["error"] is None:
            table.add_row(rung["level"], Text(_label(rung) or "–"), Text(f"{rung['status']}"))
            continue
        table.add_row(
            rung["level"],
            Text(_label(rung)),
            Text(step(rung["resolution"], rung["resolution_value"])),
            number(rung["error"]),
            number(speed["value"] if speed else None),
            f"{speed['low']:.2g} … {speed['high']:.2g}" if speed else "",
        )
    return table


def term_table(content: dict[str, Any]) -> Table:
    """One line per term and model: what it costs, what leaving it out does, and the verdict."""
    table = Table(title=Text("Terms, with and without"), title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("term", max_width=25)
    table.add_column("engine formulation", no_wrap=True)
    unit = content["unit"]
    for column in ("cost", f"with [{unit}]", "without", "moves"):
        table.add_column(Text(column), justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for row in content["terms"]:
        verdict = Worth(row["verdict"])
        cost = row["cost"]
        table.add_row(
            Text(row["term"]),
            Text(_label(row)),
            f"{cost['value']:.2f}×" if cost else "–",
            *(number(row[side]["error"] if row[side] else None) for side in ("on", "off")),
            number(row["change"]),
            Text(_SHORT.get(verdict, verdict.value), style=_STYLES.get(verdict, "")),
        )
    return table
