"""The tables of the further studies as rows of a page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from proofroll.report.labels import error, name_of, number, step, symbol, unit
from proofroll.report.tables import QuantityColumn
from proofroll.report.tradeoff_tables import cost_of

if TYPE_CHECKING:
    from proofroll.report.tradeoff_part import Advice, TradeoffEntry
    from proofroll.studies.recommend import Choice
    from proofroll.studies.tradeoff_records import CurveBudget, TradeoffStudy


@dataclass(frozen=True)
class ShownChoice:
    """A choice in words."""

    name: str
    caveat: str
    step: str
    cost: str
    error: str
    reason: str


@dataclass(frozen=True)
class AdviceLine:
    """What to use for a tolerance: the choice, or where nothing ``holds`` it the closest."""

    wanted: str
    choice: ShownChoice | None
    holds: bool
    ties: list[ShownChoice]
    runner_up: ShownChoice | None
    first_failure: ShownChoice | None
    least_model: ShownChoice | None


@dataclass(frozen=True)
class AdviceGroup:
    """The lines of one quantity, and in a few words what they name."""

    symbol: str
    said: str
    lines: list[AdviceLine]


@dataclass(frozen=True)
class FrontLine:
    """A point of the front with its errors of every shown quantity."""

    name: str
    step: str
    cost: str
    errors: list[str]


@dataclass(frozen=True)
class BudgetLine:
    """What the error of a quantity consists of along a curve."""

    name: str
    order: str
    declared: int | None
    contradicts: bool
    model_form: str
    model_form_bar: str
    floor: str
    truth: str
    sentence: str


def advice(entry: TradeoffEntry) -> list[AdviceGroup]:
    """What to use: one line for each tolerance, grouped by the quantity."""
    groups: dict[str, list[AdviceLine]] = {}
    for item in entry.advice:
        groups.setdefault(item.answer.quantity, []).append(_advice_line(item))
    found = []
    for quantity, lines in groups.items():
        named = dict.fromkeys(line.choice.name for line in lines if line.choice and line.holds)
        found.append(AdviceGroup(symbol(quantity), ", then ".join(named) or "nothing holds it", lines))
    return found


def _advice_line(item: Advice) -> AdviceLine:
    answer = item.answer
    of = unit(answer.unit)
    wanted = f"{number(answer.tolerance)} {of}".strip()
    others = (answer.runner_up, answer.first_failure, answer.least_model)
    return AdviceLine(
        f"{number(100 * item.relative)} %, {wanted}" if item.relative is not None else wanted,
        _told(answer.choice or answer.closest, of),
        answer.choice is not None,
        [tie for choice in answer.ties if (tie := _told(choice, of))],
        *(_told(choice, of) for choice in others),
    )


def front(entry: TradeoffEntry, key: str = "pareto_engines") -> list[FrontLine]:
    """The points that nothing beats for the study's own quantity: cost, and the error of every shown quantity."""
    return [
        FrontLine(
            name_of(point),
            step(point.resolution, point.step),
            cost_of(point),
            [error(point.error.get(name)) if name in point.error else "–" for name in entry.shown],
        )
        for point in entry.study.front(key, entry.study.quantity)
    ]


def budgets(entry: TradeoffEntry, quantity: str) -> list[BudgetLine]:
    """What the error of a quantity consists of along each curve."""
    study: TradeoffStudy = entry.study
    first = {point.curve: point for point in study.points}
    return [
        BudgetLine(
            name=name_of(first[item.curve]) if item.curve in first else item.curve,
            order=_order(item),
            declared=item.declared,
            contradicts=item.contradicts_declaration,
            model_form=number(item.model_form),
            model_form_bar=number(item.model_form_bar, 1),
            floor=number(item.floor, 1),
            truth=number(item.truth, 1),
            sentence=item.sentence,
        )
        for item in study.budgets
        if item.quantity == quantity
    ]


def quantities(entry: TradeoffEntry) -> list[QuantityColumn]:
    """The shown quantities with symbol and unit."""
    known = entry.study.quantities
    return [QuantityColumn(name, symbol(name), unit(known[name].unit if name in known else "")) for name in entry.shown]


def effort(study: TradeoffStudy) -> str:
    """How well speeds are known and where the choices hold, in a sentence or two."""
    said = ""
    if study.brief:
        said = (
            "Speeds were measured briefly, twice at most and those of long runs once, and the finest steps were "
            "left out: they contradict no claim. "
        )
    over = ", ".join(f"{name} {min(values):g} to {max(values):g}" for name, values in study.over.items())
    at = ", ".join(f"{name} = {value:g}" for name, value in study.parameters.items()) or "the default parameters"
    where = f"at {at} over {study.until:g} s"
    if over:
        return f"{said}Every choice holds {where}, and at the corners of {over}; nothing is known beyond."
    return f"{said}Every choice holds {where}; it was not checked over ranges of the parameters."


def _order(item: CurveBudget) -> str:
    if item.order is None:
        return "–"
    if item.order_low is None or item.order_high is None:
        return f"{item.order:.2f}"
    return f"{item.order:.2f} ± {(item.order_high - item.order_low) / 2:.2f}"


def _told(choice: Choice | None, of: str) -> ShownChoice | None:
    if choice is None:
        return None
    point, off = choice.point, f"{error(choice.error)} {of}".strip()
    size = step(point.resolution, point.step)
    return ShownChoice(name_of(point), point.caveat, size, cost_of(point), off, choice.reason)
