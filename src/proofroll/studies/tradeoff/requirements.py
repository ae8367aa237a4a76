"""Requirements of a tolerance, the measured points that meet them, and reasons why others do not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from proofroll.core.comparison import Tolerance
from proofroll.core.convergence import floor_text
from proofroll.core.engine_abilities import by_hand
from proofroll.core.errors import InputError, require_known
from proofroll.core.number_format import number
from proofroll.core.plugins import parse_engine

if TYPE_CHECKING:
    from proofroll.studies.tradeoff.records import CurveBudget, MeasuredPoint, SparseRun, TradeoffStudy

# Ratio of the tolerance to the error that is required at the scene's own parameters.
MARGIN = 2.0
_COARSE = "the step is too coarse"


@dataclass(frozen=True)
class Requirements:
    """Requirements of a tolerance.

    Attributes:
        quantity: an observable.
        tolerance: largest error of it.
        engines: the engines among which to choose; if empty, all but equations derived by hand for the scene.
        levels: the rungs among which to choose; all if empty.
    """

    quantity: str
    tolerance: Tolerance
    engines: tuple[str, ...] = ()
    levels: tuple[str, ...] = ()


def holding(study: TradeoffStudy, required: Requirements, *, here: bool = False) -> list[MeasuredPoint]:
    """All allowed points that hold the tolerance with margin, the cheapest first, untimed ones last.

    With ``here`` only the scene's own parameters matter, not the corners of the range.

    Raises:
        InputError: a quantity that was not measured, or a percentage of a quantity without a size.
    """
    absolute = absolute_tolerance(study, required)
    within = replace(study, over={}) if here else study
    points = [p for p in study.points if _asked(p, required) and failure_reason(within, p, required, absolute) is None]
    return sorted(points, key=lambda p: p.cost)


def _asked(point: MeasuredPoint, required: Requirements) -> bool:
    if required.levels and point.level not in required.levels:
        return False
    if not required.engines:
        return not by_hand(point.level) or bool(required.levels)
    return any(parse_engine(text).means(point.engine, point.settings) for text in required.engines)


def absolute_tolerance(study: TradeoffStudy, required: Requirements) -> float:
    """Tolerance in the quantity's unit. Raises InputError if a percentage has no size to refer to."""
    quantities = study.quantities
    require_known("quantity", required.quantity, quantities, "measured are")
    scale = quantities[required.quantity].scale
    if required.tolerance.relative and scale is None:
        advice = f"{required.quantity} has no size here; give it in {quantities[required.quantity].unit}"
        raise InputError("tolerance", f"{number(100 * required.tolerance.value, 3)} %", advice)
    return required.tolerance.absolute(scale or 1.0)


def failure_reason(study: TradeoffStudy, point: MeasuredPoint, required: Requirements, absolute: float) -> str | None:
    """Reason why a point does not hold the tolerance, in one sentence; None if it does."""
    sparse = point.sparse
    lives = _grid_dependence(study, sparse, required.quantity, absolute) if sparse else None
    return (
        lives
        or _reason_here(study, point, required.quantity, absolute)
        or (_reason_there(study, point, required, absolute) if study.over else None)
    )


def _reason_here(study: TradeoffStudy, point: MeasuredPoint, name: str, absolute: float) -> str | None:
    """Reason why it does not hold the tolerance with margin at the scene's own parameters, or None."""
    unit = study.quantities[name].unit
    error, off = point.error.get(name), point.envelope.get(name)
    if error is None or off is None:
        return f"{name} has no finite error: {point.message}"
    if error > absolute:
        blame = _COARSE if _finer_holds(study, point, name, absolute) else _blame(study, point, name, absolute)
        return f"{name} is off by {number(error)} {unit}; {blame}"
    if luck := _luck(study, point, name, absolute):
        return f"its error of {number(error)} {unit} is luck: {luck}"
    if off * MARGIN > absolute:
        return f"{name} is off by {number(off)} {unit}, which leaves less than a factor of {MARGIN:g} to the tolerance"
    bar = study.quantities[name].truth_error_bar or 0.0
    if bar * MARGIN > absolute:
        return f"the truth itself is known only to {number(bar)} {unit}, so nothing can be seen to hold it"
    return None


def _luck(study: TradeoffStudy, point: MeasuredPoint, name: str, absolute: float) -> str:
    """Reason why an error within the tolerance is luck: finer steps, or their limit, are beyond it; else empty."""
    unit, budget = study.quantities[name].unit, _budget(study, point, name)
    if point.envelope_of(name) > absolute:
        return f"finer steps of the same model are off by {number(point.envelope_of(name))} {unit}"
    if budget and budget.model_form is not None and budget.model_form - budget.doubt > absolute:
        return f"{number(budget.model_form)} {unit} remain in the limit of small steps"
    return ""


def _grid_dependence(study: TradeoffStudy, sparse: SparseRun, name: str, absolute: float) -> str | None:
    """Sentence on a point that holds the tolerance only because many samples shorten its steps; else None."""
    dense, rare, unit = sparse.dense_error.get(name), sparse.error.get(name), study.quantities[name].unit
    if dense is None or dense * MARGIN > absolute or (rare is not None and rare * MARGIN <= absolute):
        return None
    seen = f"{name} is off by {number(rare)} {unit}" if rare is not None else f"there is no {name}: {sparse.message}"
    return (
        f"it holds only because its steps end at every sample: sampled every {sparse.every:g} s instead of "
        f"{study.every:g} s, {seen}"
    )


def _reason_there(study: TradeoffStudy, point: MeasuredPoint, required: Requirements, absolute: float) -> str | None:
    """Reason why a point misses the tolerance at a corner of the range, or None."""
    name, unit = required.quantity, study.quantities[required.quantity].unit
    if point.corners is None:
        return "it was not checked over the range of the parameters"
    relative = required.tolerance.relative
    allowed = required.tolerance.value if relative else absolute
    for corner in point.corners:
        place = ", ".join(f"{parameter} = {value:g}" for parameter, value in corner.parameters.items())
        there = corner.off(relative).get(name)
        if there is None:
            return f"at {place} there is no {name}: {corner.message}"
        if there > allowed:
            return f"at {place} {name} is off by {number(corner.errors[name])} {unit}"
    return None


def _finer_holds(study: TradeoffStudy, point: MeasuredPoint, quantity: str, absolute: float) -> bool:
    """True if a finer step of the same curve was measured that holds the tolerance with margin."""
    finer = (p for p in study.points if p.curve == point.curve and (p.step or 0.0) < (point.step or 0.0))
    return any(p.envelope_of(quantity) * MARGIN <= absolute for p in finer)


def _budget(study: TradeoffStudy, point: MeasuredPoint, quantity: str) -> CurveBudget | None:
    """Parts of the error of a quantity along the curve of a point."""
    return next((b for b in study.budgets if b.curve == point.curve and b.quantity == quantity), None)


def _blame(study: TradeoffStudy, point: MeasuredPoint, quantity: str, absolute: float) -> str:
    """Clause on whether a finer step would help."""
    budget = _budget(study, point, quantity)
    if budget is None or budget.model_form is None:
        return "too few finer runs reached the end to say whether a finer step would suffice"
    if budget.floor is not None and budget.best_step is not None and budget.floor > absolute:
        floor = floor_text(budget.best_step, budget.floor, study.quantities[quantity].unit)
        return f"no step would do: {floor}"
    if budget.best_step is not None and (point.step or 0.0) < budget.best_step:
        return f"the step is too small for single precision, the best one is {number(budget.best_step)} s"
    if budget.model_form - (budget.model_form_bar or 0.0) > absolute:
        return f"no step would do, for {number(budget.model_form)} remain in the limit of small steps"
    if budget.model_form + (budget.model_form_bar or 0.0) > absolute:
        form = f"{number(budget.model_form)} off, known to {number(budget.model_form_bar or 0.0)}"
        return f"whether a finer step would suffice is not known: the limit of small steps is {form}"
    return _COARSE
