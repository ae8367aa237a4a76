"""Reference by steps: a motion with contacts under held targets, which no route of the truth follows.

Pinocchio's impulses at three steps, each half of the one before: the finest run is the reference, and three times its
largest change so far is its error bar. It is no truth: one formulation alone leads to it, which it never judges.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import Columns, Variable
from proofroll.core.controlled_engine import commanded
from proofroll.core.dataset import BY_STEPS, CONTINUOUS, columns_of
from proofroll.core.engine_abilities import require_provided
from proofroll.core.errors import Missing, Refused
from proofroll.core.events import JUMPS, Event, with_events
from proofroll.core.multi_element import copied, events_of_engine, watch_events
from proofroll.core.number_format import number
from proofroll.core.observable import Role
from proofroll.core.pace import PACE
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.element import MechanismElement

if TYPE_CHECKING:
    import xarray as xr

NO_ROUTE = "no route of the truth follows contacts under held targets yet"
# Engine and formulation of the steps, the longest of them [s], and how many there are.
_ENGINE, _FORMULATION, _LONGEST, _RUNGS = "pinocchio", "impulses", 1e-3, 3
_SAFETY = 3.0  # times the last change of the finest run
_ON_STEP = 1e-6  # part of a step by which a time may be beside its end


@dataclass(frozen=True)
class _Run:
    """Run with one step: its variables at the times that were asked for, and the events."""

    step: float
    columns: Columns
    events: Sequence[Event]


def reference_by_steps(element: MechanismElement, times: FloatArray) -> xr.Dataset:
    """The finest run as a dataset, each variable with its error bar.

    Raises:
        Refused: the engine of the steps is not installed, or cannot represent the mechanism.
        Diverged: a run ends early.
    """
    runs = [_run(element, times, step) for step in _steps(element)]
    coarse, fine = runs[-2:]
    near = _SAFETY * coarse.step
    events = [replace(item, time_low=item.time_low - near, time_high=item.time_high + near) for item in fine.events]
    beside = np.zeros(len(times), dtype=bool)
    for event in events:
        if event.kind in JUMPS:
            beside |= (event.time_low <= times) & (times <= event.time_high)
    # a force of a step is its impulse over its length: beside a touch no two steps have the same
    reactions = {item.name for item in element.observables if item.role is Role.REACTION}
    variables = {}
    for name, item in fine.columns.variables.items():
        bar = math.inf if name in reactions else _bar(name, coarse.columns.variables[name], item, beside)
        variables[name] = item if bar is None else item._replace(attrs={**item.attrs, "error_bar": bar})
    words = ", ".join(number(run.step, 3) for run in runs)
    attrs = {
        "route": f"reference by steps of {_ENGINE} {_FORMULATION}, dt {words} s",
        "second_route": f"{_SAFETY:g} times their last change",
        BY_STEPS: f"{_ENGINE}[formulation={_FORMULATION}]",
    }
    dataset = Columns(variables, {**fine.columns.attrs, **attrs}).dataset()
    return with_events(dataset, events) if element.mechanism.has_events else dataset


def _steps(element: MechanismElement) -> list[float]:
    """Steps, each half of the one before; whole numbers of them lie between instants of a controller."""
    control = element.mechanism.control
    longest = _LONGEST if control is None else 1 / control.rate / math.ceil(1 / control.rate / _LONGEST - _ON_STEP)
    return [longest / 2**rung for rung in range(_RUNGS)]


def _run(element: MechanismElement, times: FloatArray, step: float) -> _Run:
    """Run of a mechanism with one step; between two steps its variables are interpolated."""
    scene = Scene(name=element.name, title=element.name, elements=(element,))
    try:
        kind = load_engine(_ENGINE)
    except Missing as error:
        raise Refused(f"{NO_ROUTE}, and {error}, whose steps would be a reference") from None
    settings = resolve_settings(kind, {"formulation": _FORMULATION, "preset": "matched", "dt": step})
    require_provided(kind, settings.formulation, scene)
    engine = commanded(kind.build(scene.for_an_engine, settings), element, step)
    watch_events(engine)
    before, part = np.floor(times / step + _ON_STEP), times / step
    part = np.where(np.abs(part - np.round(part)) <= _ON_STEP, 0.0, part - before)
    counts = np.union1d(before, before[part > 0] + 1)
    PACE.follow("second", float(times[-1]))
    samples = [copied(engine.sample())]
    for count in counts[1:].tolist():
        engine.advance(count * step)
        PACE.reached(count * step)
        samples.append(copied(engine.sample()))
    PACE.leave()
    columns = columns_of(scene, counts * step, samples)
    first, last = np.searchsorted(counts, before), np.searchsorted(counts, before + (part > 0))
    variables = {}
    for name, item in columns.variables.items():
        if item.dims[:1] != ("time",):
            variables[name] = item
            continue
        weight = part.reshape(-1, *[1] * (item.values.ndim - 1))
        between = item.values[first] + weight * (item.values[last] - item.values[first])
        variables[name] = item._replace(values=times if name == "time" else between)
    found = events_of_engine(engine, element) or ()
    return _Run(step, Columns(variables, columns.attrs), tuple(event for event in found if event.time <= times[-1]))


def _bar(name: str, coarse: Variable, fine: Variable, beside: npt.NDArray[np.bool_]) -> float | None:
    """Error bar of a variable; None: it has no times. Samples ``beside`` an impact do not count for jumps."""
    if name == "time" or fine.dims[:1] != ("time",) or fine.values.dtype.kind != "f":
        return None
    change = np.abs(fine.values - coarse.values)
    if fine.dims[-1:] == ("wxyz",):  # of two signs of a quaternion
        change = np.minimum(change, np.abs(fine.values + coarse.values))
    if fine.attrs.get("units") not in CONTINUOUS:
        change = change[~beside]
    known = change[np.isfinite(change)]
    return _SAFETY * float(known.max(initial=0.0)) if known.size else math.inf
