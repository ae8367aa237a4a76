"""Judgement of a file's statements: measured and stated values, and whether these agree to the stated digits."""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Callable, Iterator
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.events import events_of
from proofroll.papers.blajer_2006.figures.definition import Statement
from proofroll.papers.blajer_2006.figures.measures import MEASURES, measured
from proofroll.papers.blajer_2006.figures.quantities import TIME
from proofroll.papers.blajer_2006.figures.study import FigureRun, FigureRuns

if TYPE_CHECKING:
    import xarray as xr

Measured = float | list[float] | list[str] | None
_BOUNDS: dict[str, tuple[str, Callable[[float, float], bool]]] = {
    "at_most": ("≤", operator.le),
    "below": ("<", operator.lt),
    "above": (">", operator.gt),
}
# Half a unit of the last digit, and a margin for the round-off of a double.
_HALF = Decimal("0.5") * (1 + Decimal("1e-9"))


def judgements(study: FigureRuns) -> list[dict[str, Any]]:
    """One entry for each statement and run, or for each statement about the order of runs.

    Each has ``says``, ``source``, ``ours``, ``defined`` (definition of its measure), ``because``, ``runs``, ``of``,
    ``measure``, ``unit``, ``stated`` (text), ``found`` (value of the engine), ``truth`` (value of the truth) and
    ``holds``; ``found`` and ``holds`` are None if the engine has no such value, and ``why`` is the reason.
    """
    return [
        _entry(study, item, runs)
        for item in study.figures.statements
        for runs in ([item.runs] if item.order else [[run] for run in item.runs])
    ]


def rounds_to(value: float, stated: str) -> bool:
    """True if a number rounds to the stated one: it differs by at most half a unit of the last stated digit."""
    number = Decimal(stated)
    exponent = number.as_tuple().exponent
    assert isinstance(exponent, int)  # finite, as the file was checked for
    return math.isfinite(value) and abs(Decimal(value) - number) <= _HALF.scaleb(exponent)


def _entry(study: FigureRuns, item: Statement, runs: list[str]) -> dict[str, Any]:
    value = _found(item, [study.runs[name] for name in runs])
    why = next(_reasons(study, item, runs), "") if value is None else ""
    return {
        "says": item.says,
        "source": item.source,
        "ours": item.ours,
        "defined": MEASURES[item.measure].definition if item.measure in MEASURES else "",
        "because": item.because,
        "runs": runs,
        "of": item.of,
        "measure": item.measure,
        "unit": _unit(study, item),
        "stated": _stated(item),
        "found": value,
        "truth": _found(item, [study.truths[name] for name in runs]),
        "holds": None if value is None else _holds(item, value),
        "why": why,
    }


def _unit(study: FigureRuns, item: Statement) -> str:
    if item.event is not None:
        return "s"
    if item.events:
        return ""
    measure_unit = MEASURES[item.measure].unit if item.measure in MEASURES else None
    return study.units[item.of] if measure_unit is None else measure_unit


def _stated(item: Statement) -> str:
    (criterion,) = item.criteria
    if criterion in _BOUNDS:
        return f"{_BOUNDS[criterion][0]} {getattr(item, criterion):g}"
    return ", ".join(item.events) or str(getattr(item, criterion))


def _found(item: Statement, made: list[FigureRun]) -> Measured:
    """Measured value of a run, or values of several runs for ``order``; None: a run has none."""
    values = [_value(item, run) for run in made]
    if item.order:
        numbers = [value for value in values if isinstance(value, float)]
        return numbers if len(numbers) == len(values) else None
    return values[0]


def _value(item: Statement, made: FigureRun) -> Measured:
    if not made.done or made.dataset is None:
        return None
    if item.events or item.event is not None:
        return _happened(item, made.dataset)
    values = made.curve(item.of, item.until)
    if values is None:
        return None
    if item.measure == "every":
        return float(values[np.argmax(np.abs(values - float(item.stated)))])
    return measured(item.measure, made.dataset[TIME].to_numpy()[: values.size], values)


def _happened(item: Statement, dataset: xr.Dataset) -> Measured:
    """Kinds of the events, or the time of one [s], NaN if it did not happen; None: the run has no events."""
    if "event_kind" not in dataset:
        return None
    events = [event for event in events_of(dataset) if item.until is None or event.time <= item.until]
    if item.event is None:
        return [str(event.kind) for event in events]
    return events[item.event].time if 0 <= item.event < len(events) else math.nan


def _holds(item: Statement, value: Measured) -> bool:
    (criterion,) = item.criteria
    if isinstance(value, list):
        if criterion == "events":
            return value == item.events
        compare = operator.lt if item.order == "rising" else operator.gt
        return all(compare(a, b) for a, b in itertools.pairwise(float(item) for item in value))
    assert value is not None  # what was not found is not judged
    if criterion == "stated":
        return rounds_to(value, item.stated)
    return _BOUNDS[criterion][1](value, getattr(item, criterion))


def _reasons(study: FigureRuns, item: Statement, runs: list[str]) -> Iterator[str]:
    """Reasons for a missing value: runs that failed, or a quantity that the engine does not give."""
    for name in runs:
        result = study.runs[name].result
        if not study.runs[name].done:
            yield f"{name}: {result.status}, {result.message}"
    yield f"{study.engine} does not tell {item.of or 'events'}"
