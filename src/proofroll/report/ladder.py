"""Content of ``proofroll ladder`` as records, as sentences and as tables for the terminal."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeVar

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.arrays import largest_difference
from proofroll.core.errors import ProofrollError
from proofroll.core.number_format import number
from proofroll.files.json_data import MERGED
from proofroll.report.labels import step
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll.running.case import EngineDescription, Status
from proofroll.running.process import status_of
from proofroll.running.timing import Interval, machine, ratio
from proofroll.studies.ladder.ladder import Ladder, key_of
from proofroll.studies.ladder.models import LadderModel, Need, Ran, Rung, Switch, need_of_term

_SHORT = {Need.NOT_NEEDED: "not needed"}
_STYLES = {Need.NEEDED: "green", Need.NOT_NEEDED: "yellow", Need.HARMFUL: "red", Need.NO_ANSWER: "bold red"}


@dataclass(frozen=True)
class RungFound:
    """A rung of the ladder; its ``status`` is ``empty`` if no engine has a model of the level."""

    level: str
    variant: str
    engine: str | None
    formulation: str | None
    preset: str | None
    ran: Ran = field(metadata=MERGED)
    resolution: str | None = None
    resolution_value: float | None = None


@dataclass(frozen=True)
class SideFound:
    """A run of a model with a term, or without it."""

    parameters: dict[str, float]
    asks: list[str]
    ran: Ran = field(metadata=MERGED)


@dataclass(frozen=True)
class TermFound:
    """A term of a model, tested with and without against the truth of the scene with it.

    Attributes:
        term, kind, engine, formulation, because: see :class:`Switch`.
        verdict: worth of the term, as ``needed``.
        reason: ground of the verdict.
        on, off: with it and without.
        cost: ratio of the run's times with it and without.
        change: largest change of the quantity when it is left out.
        error_change: error without it minus error with it.
    """

    term: str
    kind: str
    engine: str
    formulation: str
    because: str
    verdict: Need
    reason: str
    on: SideFound | None = None
    off: SideFound | None = None
    cost: Interval | None = None
    change: float | None = None
    error_change: float | None = None


@dataclass(frozen=True)
class KnownTruth:
    """Route of the truth, and the error bar of the quantity."""

    route: str | None
    error_bar: float


@dataclass(frozen=True)
class Absence:
    """Status of an engine that takes no part, with the reason."""

    status: str
    message: str


@dataclass(frozen=True)
class LadderContent:
    """Question, results and conclusions (``findings``) of a ladder; ``unplaced``: engines that declare no level."""

    scene: str
    parameters: dict[str, float]
    quantity: str
    unit: str
    scale: float | None
    tolerance: float | None
    until: float
    truth: KnownTruth
    rungs: list[RungFound]
    terms: list[TermFound]
    absent: dict[str, Absence]
    unplaced: list[str]
    machine: dict[str, str]
    findings: list[str]


def ladder_content(study: Ladder) -> LadderContent:
    """Records of the study."""
    truth = study.truths[str({})]
    content = LadderContent(
        scene=study.scene.name,
        parameters=dict(study.scene.parameters),
        quantity=study.quantity,
        unit=study.unit,
        scale=truth.sizes.get(study.quantity),
        tolerance=study.tolerance,
        until=study.until,
        truth=KnownTruth(truth.dataset.attrs.get("route"), study.bar({})),
        rungs=[_rung(study, rung) for rung in study.ladder],
        terms=[_term(study, switch) for switch in study.switches],
        absent={
            name: Absence(status_of(engine).value, str(engine))
            for name, engine in study.engines.items()
            if isinstance(engine, ProofrollError)
        },
        unplaced=[
            name
            for name, engine in study.engines.items()
            if isinstance(engine, EngineDescription) and not engine.levels
        ],
        machine=machine(),
        findings=[],
    )
    return replace(content, findings=list(_conclusions(content)))


def _rung(study: Ladder, rung: Rung) -> RungFound:
    model, case = rung.model, None
    ran = Ran(settings=None, status="empty", message=rung.message, error=None, seconds_per_second=None)
    if model is not None:
        case, ran = study.answers[key_of(model)].case, _ran(study, model, {})
    resolution = case.engine.resolution if case else None
    return RungFound(
        level=rung.level.value,
        variant=rung.variant,
        engine=model.engine if model else None,
        formulation=model.formulation if model else None,
        preset=model.options["preset"] if model else None,
        ran=ran,
        resolution=resolution,
        resolution_value=case.engine.settings.get(resolution) if case and resolution else None,
    )


def _ran(study: Ladder, model: LadderModel, point: dict[str, float]) -> Ran:
    answer = study.answers[key_of(model)]
    message = answer.result.message
    if answer.result.status == Status.DONE and answer.values is None:
        message = f"the engine does not give {study.quantity}"
    return Ran(
        settings=answer.case.engine.settings if answer.case else None,
        status=answer.result.status.value,
        message=message,
        error=study.error(model, point),
        seconds_per_second=answer.timing.interval if answer.timing else None,
    )


def _term(study: Ladder, switch: Switch) -> TermFound:
    names = (switch.term, switch.kind, switch.model.engine, switch.model.formulation, switch.because)
    if switch.on is None or switch.off is None:
        return TermFound(*names, Need.INHERENT, f"cannot be left out: {switch.because}")
    point = dict(switch.on.parameters)
    on, off = (
        SideFound(dict(model.parameters), list(model.asks), _ran(study, model, point))
        for model in (switch.on, switch.off)
    )
    with_it, without = study.answers[key_of(switch.on)], study.answers[key_of(switch.off)]
    cost = ratio(with_it.timing, without.timing) if with_it.timing and without.timing else None
    change = error_change = None
    if with_it.values is not None and without.values is not None:
        change = largest_difference(with_it.values, without.values)
    if on.ran.error is not None and off.ran.error is not None:
        error_change = off.ran.error - on.ran.error
    verdict, reason = need_of_term(
        on.ran,
        off.ran,
        change,
        cost,
        tolerance=study.tolerance,
        bar=study.bar(point),
        scale=study.truths[str({})].sizes.get(study.quantity, 1.0),
    )
    return TermFound(
        *names, verdict=verdict, reason=reason, on=on, off=off, cost=cost, change=change, error_change=error_change
    )


def label(row: RungFound | TermFound) -> str:
    """Engine, formulation and variant of a row, as text."""
    variant = row.variant if isinstance(row, RungFound) else ""
    return " ".join(filter(None, (row.engine, row.formulation, variant)))


def _conclusions(content: LadderContent) -> Iterator[str]:
    """Conclusions of the ladder, in sentences."""
    name, unit = content.quantity, content.unit
    empty = [rung.level for rung in content.rungs if rung.ran.status == "empty"]
    if empty:
        yield f"No engine that was asked has a model of the level {', '.join(empty)}."
    # A rung whose error is as large as the quantity itself is useless, however cheap.
    useful = [
        (rung, rung.ran.seconds_per_second.value, rung.ran.error)
        for rung in content.rungs
        if rung.ran.error is not None and rung.ran.seconds_per_second and rung.ran.error < (content.scale or math.inf)
    ]
    if useful:
        rungs = "; ".join(f"{label(rung)} ({number(rung.ran.error)} {unit})" for rung in front(useful))
        yield f"The nearest to the true {name} for their cost, from the cheapest on: {rungs}."
    if content.tolerance is not None:
        yield _cheapest(useful, content.tolerance, f"{content.tolerance:g} {unit}")
    yield from _of_terms(content)
    for rung in content.rungs:
        if rung.ran.status not in {"done", "empty"} and not rung.variant:  # those are among the terms
            yield f"{label(rung)} {rung.ran.status}: {rung.ran.message}."
    for engine, absent in content.absent.items():
        yield f"{engine} is {absent.status}: {absent.message}."
    if content.unplaced:
        yield f"Not on the ladder (no levels declared): {', '.join(content.unplaced)}."


def _cheapest(useful: list[tuple[RungFound, float, float]], tolerance: float, bound: str) -> str:
    """Sentence on the cheapest rung within a tolerance; ``bound`` is the tolerance with its unit."""
    within = [entry for entry in useful if entry[2] <= tolerance]
    if not within:
        return f"No rung is within {bound} at its own step."
    best, _, error = min(within, key=lambda entry: entry[1])
    return f"The cheapest within {bound} is {label(best)} ({best.level}), off by {number(error)}."


def _of_terms(content: LadderContent) -> Iterator[str]:
    """Sentences on the terms: one per term and verdict, over all models."""
    name, unit = content.quantity, content.unit
    groups: dict[tuple[str, Need], list[TermFound]] = {}
    for judged_term in content.terms:
        groups.setdefault((judged_term.term, judged_term.verdict), []).append(judged_term)
    for (term, verdict), rows in groups.items():
        labels = ", ".join(label(row) for row in rows)
        largest = max((row.change for row in rows if row.change is not None), default=None)
        match verdict:
            case Need.NEEDED if largest is not None:
                yield f"{term} is needed in {labels}: leaving it out moves {name} by up to {number(largest)} {unit}."
            case Need.NEEDED:
                yield f"{term} is needed in {labels}: {rows[0].reason}."
            case Need.HARMFUL:
                yield f"{term} moves {name} away from the truth in {labels}, by up to {number(largest)} {unit}."
            case Need.NOT_NEEDED:
                times = ", ".join(f"{label(row)} ({row.cost.value:.2f}×)" for row in rows if row.cost)
                most = f"{name} moves by {number(largest, 1)} {unit} at most"
                yield f"{term} is paid for but not needed in {times}: {most}."
            case Need.INHERENT:
                yield f"{term}: it cannot be left out of {labels}."
            case Need.NO_ANSWER:
                yield f"{term}: {label(rows[0])} {rows[0].reason.removeprefix('with it: ')}."


_Item = TypeVar("_Item")


def front(entries: Iterable[tuple[_Item, float, float]]) -> list[_Item]:
    """Items of ``(item, cost, error)`` that no other item matches or beats in both, cheapest first."""
    kept: list[_Item] = []
    best = float("inf")
    for item, _, error in sorted(entries, key=lambda entry: (entry[1], entry[2])):
        if error < best:
            kept.append(item)
            best = error
    return kept


def ladder_parts(content: LadderContent) -> list[Table | str]:
    """Both tables, and the conclusions."""
    return [rung_table(content), "", term_table(content), "", *content.findings]


def rung_table(content: LadderContent) -> Table:
    """Table of the rungs, from the simplest model to the most complete."""
    title = f"{content.quantity} of {content.scene} over {content.until:g} s, from the least model to the most"
    table = plain_table(
        *unbroken("level", "engine formulation", "step"),
        *numeric(f"error [{content.unit}]", "s/s", "low … high"),
        title=title,
    )
    for rung in content.rungs:
        speed = rung.ran.seconds_per_second
        if rung.ran.error is None:
            table.add_row(rung.level, Text(label(rung) or "–"), Text(rung.ran.status))
            continue
        table.add_row(
            rung.level,
            Text(label(rung)),
            Text(step(rung.resolution, rung.resolution_value)),
            number(rung.ran.error),
            number(speed.value if speed else None),
            f"{speed.low:.2g} … {speed.high:.2g}" if speed else "",
        )
    return table


def term_table(content: LadderContent) -> Table:
    """Table of terms and models: cost of the term, effect of leaving it out, and the verdict."""
    table = plain_table(
        Column("term", max_width=25),
        *unbroken("engine formulation"),
        *numeric("cost", f"with [{content.unit}]", "without", "moves"),
        *unbroken("verdict"),
        title="Terms, with and without",
    )
    for row in content.terms:
        table.add_row(
            Text(row.term),
            Text(label(row)),
            f"{row.cost.value:.2f}×" if row.cost else "–",
            *(number(side.ran.error if side else None) for side in (row.on, row.off)),
            number(row.change),
            Text(_SHORT.get(row.verdict, row.verdict.value), style=_STYLES.get(row.verdict, "")),
        )
    return table
