"""Reference by steps: a motion with contacts under held targets, which no route of the truth follows.

A formulation that declares it (:class:`proofroll.core.engine_abilities.ServesAsReference`) runs with three steps, each
half of the one before: the finest run is the reference, and three times its largest change so far is its error bar. It
is no truth: one formulation alone leads to it, which it never judges.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import Columns, Variable
from proofroll.core.controlled_engine import commanded
from proofroll.core.dataset import BARS, BY_STEPS, CONTINUOUS, ENDED, ENDS, HORIZON, columns_of, ended_at
from proofroll.core.engine_abilities import require_provided
from proofroll.core.errors import Diverged, Missing, Refused
from proofroll.core.events import Event, with_events
from proofroll.core.multi_element import copied, events_of_engine, sample_of, watch_events
from proofroll.core.number_format import number
from proofroll.core.pace import PACE, OutOfTime
from proofroll.core.plugins import load_engine, parse_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.joint_kinds import JointKind

if TYPE_CHECKING:
    import xarray as xr

_HELD, _SHARED = "under held targets yet", "whose sliding and turning share a cone"
# Longest step [s], how many steps there are, and how many of them an error bar needs.
_LONGEST, _RUNGS, _NEEDED = 1e-3, 3, 2
# How many twins there are, how far apart they start [m, rad], and the distances up to which a motion is told [m].
_TWINS, _NUDGE, _TOLD = 5, 1e-4, (1e-3, 1e-2)
_WITNESSED = 2  # engines of a reference with a witness
_SAFETY = 3.0  # times the last change of the finest run
_ON_STEP = 1e-6  # part of a step by which a time may be beside its end


@dataclass(frozen=True)
class _SteppedRun:
    """Run with one step.

    Attributes:
        step: its length [s].
        columns: variables at the times that were asked for, up to where it ended.
        events: up to the last of these times.
        whole: False if the limit of processor time ended it.
    """

    step: float
    columns: Columns
    events: Sequence[Event]
    whole: bool


def reference_by_steps(element: MechanismElement, times: FloatArray, engines: Sequence[str]) -> xr.Dataset:
    """The finest run as a dataset, each variable with its error bar.

    Where the limit of processor time ends the finest run, the reference is the one before it; with one run before it,
    it is what the finest has.

    Args:
        element: the mechanism.
        times: of the samples [s], shape (time,).
        engines: ``name[formulation=…]`` of the steps, and of the twins; without the second there are none.

    Raises:
        Refused: no engine is installed whose steps would be a reference.
        Diverged: a run ends early.
    """
    reason = f"no route of the truth follows contacts {_SHARED if element.mechanism.shares_cone else _HELD}"
    if not engines:
        raise Refused(f"{reason}, and no installed engine that represents it declares its steps as a reference")
    runs: list[_SteppedRun] = []
    steps = _steps(element)
    PACE.follow("steps", sum(times[-1] / step for step in steps))
    for step in steps:
        try:
            runs.append(_run(element, times, step, engines[0], before=sum(times[-1] / run.step for run in runs)))
        except Diverged as error:
            by = f"{_words(engines[0])}, dt {number(step, 3)} s"
            raise Diverged(f"{reason}, and the steps of {by} end: {error}", error.time) from None
        if not runs[-1].whole:
            break
    PACE.leave()
    runs = runs[:-1] if len(runs) > _NEEDED and not runs[-1].whole else runs
    if len(runs) < _NEEDED:
        raise Diverged(f"{reason}, and the processor time did not suffice for two runs by steps")
    count = runs[-1].columns.variables["time"].values.size
    if count < len(times):
        runs = [replace(run, columns=run.columns.at("time", np.ones(count, dtype=bool))) for run in runs]
    coarse, fine = runs[-2:]
    near = _SAFETY * coarse.step
    last = float(times[count - 1])
    told = [item for item in fine.events if item.time <= last]
    events = [replace(item, time_low=item.time_low - near, time_high=item.time_high + near) for item in told]
    variables = {}
    for name, item in fine.columns.variables.items():
        bars = _bars(name, coarse.columns.variables[name], item, times[:count])
        variables[name] = item._replace(attrs={**item.attrs, **bars})
    words = ", ".join(number(run.step, 3) for run in runs)
    attrs = {
        "route": f"reference by steps of {_words(engines[0])}, dt {words} s",
        "second_route": f"{_SAFETY:g} times their last change",
        BY_STEPS: engines[0],
        **({ENDS: float(times[count]), ENDED: "the limit of processor time was reached"} if count < len(times) else {}),
    }
    dataset = Columns(variables, {**fine.columns.attrs, **attrs}).dataset()
    dataset = with_events(dataset, events) if element.mechanism.has_events else dataset
    if len(engines) < _WITNESSED:
        return dataset
    twins = _twins(element, times[:count], runs[0].step, engines[1])
    if not twins:
        return dataset
    apart = np.max([_distances(twins[0], run) for run in twins[1:]], axis=0)
    dataset = _to_horizon(dataset, apart, _distances(coarse, fine))
    distance = float(_distances(twins[0], fine)[dataset.sizes["time"] - 1])
    witness = f"{_words(engines[1])}, dt {number(twins[0].step, 3)} s, is within {number(distance, 2)} m of it"
    return dataset.assign_attrs(second_route=f"{attrs['second_route']}; {witness}")


def _words(engine: str) -> str:
    """Engine and formulation for a reader."""
    spec = parse_engine(engine)
    return f"{spec.name} {spec.options['formulation']}"


def _twins(element: MechanismElement, times: FloatArray, step: float, engine: str) -> list[_SteppedRun]:
    """Runs of a mechanism and of twins whose starts are a little apart; empty: the engine cannot run them."""
    random, mechanism = np.random.default_rng(0), element.mechanism
    twins = [element]
    for _ in range(_TWINS):
        joints = []
        for joint in mechanism.joints:
            moved = np.array(joint.q0)
            places = slice(0, 0 if joint.kind == JointKind.SPHERICAL else 3)  # an attitude stays a unit quaternion
            moved[places] += _NUDGE * random.uniform(-1, 1, moved[places].size)
            joints.append(replace(joint, q0=tuple(moved.tolist())))
        twins.append(replace(element, mechanism=replace(mechanism, joints=tuple(joints))))
    try:
        return [_run(twin, times, step, engine, places=True) for twin in twins]
    except (Missing, Refused, Diverged):
        return []


def _distances(run: _SteppedRun, other_run: _SteppedRun) -> FloatArray:
    """Largest distance so far between the places of any body in two runs [m], shape (time,)."""
    places, other_places = (item.columns.variables["p_WB"].values for item in (run, other_run))
    apart = np.linalg.norm(places - other_places, axis=-1).reshape(len(places), -1).max(axis=1)
    return np.maximum.accumulate(apart)


def _to_horizon(dataset: xr.Dataset, apart: FloatArray, change: FloatArray) -> xr.Dataset:
    """The reference up to where it tells the motion, with the words about it.

    Args:
        dataset: the reference.
        apart: largest distance of twins so far [m], shape (time,).
        change: last change of places by a shorter step, the largest so far [m], shape (time,).
    """
    times = dataset["time"].to_numpy()
    words = []
    for told in _TOLD:
        beyond = np.flatnonzero((apart > told) | (change > told / _SAFETY))
        until = "to the end" if not beyond.size else f"until {times[max(beyond[0] - 1, 0)]:.3g} s"
        words.append(f"{1e3 * told:g} mm {until}")
    text = f"starts {number(_NUDGE, 1)} m or rad apart, and shorter steps, stay within {', '.join(words)}"
    dataset.attrs[HORIZON] = text
    if not beyond.size or beyond[0] < 1:
        return dataset
    return ended_at(dataset, int(beyond[0]), f"it is too sensitive from there on: {text}")


def _steps(element: MechanismElement) -> list[float]:
    """Steps, each half of the one before; whole numbers of them lie between instants of a controller."""
    control = element.mechanism.control
    longest = _LONGEST if control is None else 1 / control.rate / math.ceil(1 / control.rate / _LONGEST - _ON_STEP)
    return [longest / 2**rung for rung in range(_RUNGS)]


def _run(
    element: MechanismElement,
    times: FloatArray,
    step: float,
    engine_name: str,
    before: float = 0.0,
    *,
    places: bool = False,
) -> _SteppedRun:
    """Run of a mechanism in an engine with one step; between two steps its variables are interpolated.

    Args:
        element: the mechanism.
        times: of the samples [s], shape (time,).
        step: its length [s].
        engine_name: ``name[formulation=…]``.
        before: number of steps of the runs before it.
        places: True for the places of bodies alone.
    """
    scene = Scene(name=element.name, title=element.name, elements=(element,))
    spec = parse_engine(engine_name)
    kind = load_engine(spec.name)
    claim = kind.references[spec.options["formulation"]]
    settings = resolve_settings(kind, {"preset": "matched", **claim.settings, **spec.options, "dt": step})
    require_provided(kind, settings.formulation, scene)
    engine = commanded(kind.build(scene.for_an_engine, settings), element, step)
    watch_events(engine)
    whole_steps, part = np.floor(times / step + _ON_STEP), times / step
    part = np.where(np.abs(part - np.round(part)) <= _ON_STEP, 0.0, part - whole_steps)
    counts = np.union1d(whole_steps, whole_steps[part > 0] + 1)
    samples = [copied(engine.sample())]
    for count in counts[1:].tolist():
        engine.advance(count * step)
        samples.append(copied(engine.sample()))
        try:
            PACE.reached(before + count)
        except OutOfTime:
            break
    whole, counts = len(samples) == len(counts), counts[: len(samples)]
    told = whole_steps + (part > 0) <= counts[-1]
    times, whole_steps, part = times[told], whole_steps[told], part[told]
    if places:
        p_WB = Variable(
            ("time", "body", "xyz"), np.array([sample_of(scene, element, sample).p_WB for sample in samples])
        )
        columns = Columns({"time": Variable(("time",), counts * step), "p_WB": p_WB})
    else:
        columns = columns_of(scene, counts * step, samples)
    first, last = np.searchsorted(counts, whole_steps), np.searchsorted(counts, whole_steps + (part > 0))
    variables = {}
    for key, item in columns.variables.items():
        if item.dims[:1] != ("time",):
            variables[key] = item
            continue
        weight = part.reshape(-1, *[1] * (item.values.ndim - 1))
        between = item.values[first] + weight * (item.values[last] - item.values[first])
        variables[key] = item._replace(values=times if key == "time" else between)
    events = events_of_engine(engine, element) or ()
    events = tuple(event for event in events if event.time <= times[-1])
    return _SteppedRun(step=step, columns=Columns(variables, columns.attrs), events=events, whole=whole)


def _bars(name: str, coarse: Variable, fine: Variable, times: FloatArray) -> dict[str, Any]:
    """Attributes with the error bar of a variable at the end, and as it grows; empty: the variable has no times.

    It is inf for velocities, forces and what follows from them: beside a touch no two steps have the same.
    """
    if name == "time" or fine.dims[:1] != ("time",) or fine.values.dtype.kind != "f":
        return {}
    changes = [fine.values - coarse.values]
    if fine.dims[-1:] == ("wxyz",):  # of two signs of a quaternion
        changes.append(fine.values + coarse.values)
    if fine.dims[-1:] in {("xyz",), ("wxyz",)}:
        changes = [np.linalg.norm(change, axis=-1) for change in changes]
    change = np.min(np.abs(changes), axis=0).reshape(len(times), -1)
    if fine.attrs.get("units") not in CONTINUOUS or not np.isfinite(change).any():
        return {"error_bar": math.inf}
    bars = _SAFETY * np.maximum.accumulate(np.where(np.isfinite(change), change, 0.0).max(axis=1))
    grown = np.flatnonzero(np.diff(bars, prepend=-1.0) > 0)
    return {"error_bar": float(bars[-1]), BARS: np.stack([times[grown], bars[grown]], axis=1).ravel().tolist()}
