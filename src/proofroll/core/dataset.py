"""Result of a run: the variables of all its elements, with units, as one dataset."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import Columns, Variable
from proofroll.core.element import Element
from proofroll.core.element_abilities import WatchesRuns
from proofroll.core.events import JUMPS, Event, event_columns, events_of
from proofroll.core.multi_element import AnySample, sample_of
from proofroll.core.observable import Role
from proofroll.core.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

Key = TypeVar("Key", bound=Hashable)

# Dimensions that the variables of all elements share; every other is an element's own.
_SHARED = frozenset({"time", "xyz", "wxyz", "between"})
# Dimension of the samples off the grid of times, and prefix of the names of their variables.
BETWEEN = "between"
# Attributes of a truth that ends early: from when on it is not known [s], and why, as a clause.
ENDS, ENDED = "ends", "ended"
# Attribute of a reference by steps: the engine and formulation of its steps, as a setting; it is no truth.
BY_STEPS = "by_steps"
# Attribute of a truth with the times at which what acts changes [s], also where no event is told.
BORDERS = "borders"
HORIZON = "horizon_words"  # attribute of a reference by steps: how far it tells the motion, a clause
BARS = "error_bars"  # attribute of a variable: times [s], each with its error bar from there on, in one flat list
LAWS = "laws"  # attribute of a truth: outcome of its law check, a clause
# Attribute: widest bracket [s] of the events at the end that are left out of a comparison.
LEFT_OUT = "widest_bracket_left_out"
# A sample that is nearer to an impact than this part of the sampling interval lies on it.
_ON_IMPACT = 1e-6
# Units of what an impact leaves as it is, reactions apart: places, angles and orientations.
CONTINUOUS = frozenset({"m", "rad", "1"})


def from_samples(scene: Scene, times: FloatArray, samples: Sequence[AnySample]) -> xr.Dataset:
    """Trajectory of a run as an xarray dataset, see :func:`columns_of`."""
    return columns_of(scene, times, samples).dataset()


def columns_of(scene: Scene, times: FloatArray, samples: Sequence[AnySample]) -> Columns:
    """Trajectory of a run.

    Args:
        scene: of the run.
        times: [s], shape (time,).
        samples: one for each time; fewer if the run ended early.
    """
    reached = np.asarray(times[: len(samples)], dtype=np.float64)
    parts = {
        element.name: element.variables(reached, [sample_of(scene, element, sample) for sample in samples])
        for element in scene.elements
    }
    return joined(scene, parts)


def ended_early(dataset: xr.Dataset | Columns) -> tuple[float, str] | None:
    """Time [s] at which a truth ends early, and why, as a clause; None: it has all samples that were asked for."""
    return (float(dataset.attrs[ENDS]), str(dataset.attrs[ENDED])) if ENDS in dataset.attrs else None


def bar_until(attributes: Mapping[str, Any], time: float) -> float:
    """Error bar of a variable up to a time [s], from its attributes; infinite: it has none."""
    times, bars = np.reshape(attributes.get(BARS, ()), (-1, 2)).T
    count = int(np.searchsorted(times, time, side="right"))
    return float(bars[count - 1] if count else attributes.get("error_bar", np.inf))


def ended_at(dataset: xr.Dataset, count: int, reason: str) -> xr.Dataset:
    """A truth that ends behind its first ``count`` samples, with the error bars until then; ``reason``: a clause."""
    cut, end = dataset.isel(time=slice(count)), float(dataset["time"][count])
    for item in cut.data_vars.values():
        item.attrs |= {"error_bar": bar_until(item.attrs, float(cut["time"][-1]))} if BARS in item.attrs else {}
    return cut.assign_attrs({ENDS: end, ENDED: reason})


def end_of_truth(end: float) -> str:
    """Clause on the time [s] from which a truth has no value."""
    return f"the truth ends at t = {end:.6g} s"


def truth_message(dataset: xr.Dataset | Columns) -> str:
    """Sentence about a truth: when and why it ends early, why it is ill-posed; else its routes and the law check."""
    notes, end = [str(dataset.attrs.get("ill_posed", ""))], ended_early(dataset)
    if end is not None:
        times = dataset["time"].values
        notes = [note for note in notes if note != end[1]]
        counted = f"{len(times)} sample{'s' if len(times) > 1 else ''}"
        samples = f", behind its {counted}" if end[0] > times[0] else ""  # at its start it has none
        notes.append(f"{end_of_truth(end[0])}{samples}: {end[1]}")
    if any(notes):
        return "; ".join(filter(None, notes))
    routes = f"{dataset.attrs['route']}, checked by {dataset.attrs['second_route']}"
    return "; ".join(filter(None, (routes, str(dataset.attrs.get(LAWS, "")))))


def joined(scene: Scene, parts: Mapping[str, Columns]) -> Columns:
    """Variables of all elements under their names in the scene; of the attributes those on which the elements agree."""
    variables: dict[str, Variable] = {}
    attrs: dict[str, Any] = {}
    for element in scene.elements:
        variables |= _labelled(scene, element, parts[element.name].variables)
    for key in dict.fromkeys(key for part in parts.values() for key in part.attrs):
        values = [part.attrs[key] for part in parts.values() if key in part.attrs]
        if all(np.array_equal(value, values[0]) for value in values):
            attrs[key] = values[0]
    return Columns(variables, {**attrs, "scene": scene.name, "scene_digest": scene.digest})


def off_grid_apart(scene: Scene, columns: Columns, asked: FloatArray, between: FloatArray) -> Columns:
    """Columns with samples off the grid moved to variables ``between.<name>``, for observables and states only.

    Args:
        scene: of the run.
        columns: all samples.
        asked: times of the grid [s].
        between: times off the grid that are kept [s]; all other times are left out.
    """
    times = columns["time"].values
    off = np.isin(times, between) & ~np.isin(times, asked)
    on_grid = columns if np.all(on := np.isin(times, asked)) else columns.at("time", on)
    if not np.any(off):
        return on_grid
    states = {scene.label(element, name) for element in scene.elements for name in element.sample_type.widths}
    few = {name: columns[name] for name in columns.variables if name in states or name in scene.observables}
    apart = {
        f"{BETWEEN}.{name}": item._replace(dims=(BETWEEN, *item.dims[1:]), values=item.values[off])
        for name, item in few.items()
        if item.dims[:1] == ("time",)
    }
    apart[BETWEEN] = Variable((BETWEEN,), times[off], {"units": "s"})
    return Columns({**on_grid.variables, **apart}, on_grid.attrs)


def _labelled(scene: Scene, element: Element, variables: Mapping[str, Variable]) -> dict[str, Variable]:
    """The variables of an element, and their dimensions, under their names in the scene."""

    def name(short_name: str) -> str:
        return short_name if short_name in _SHARED else scene.label(element, short_name)

    return {name(short_name): item._replace(dims=tuple(map(name, item.dims))) for short_name, item in variables.items()}


def add_events(scene: Scene, element: Element, columns: Columns, events: Sequence[Event]) -> Columns:
    """The columns with the events of an element."""
    return Columns({**columns.variables, **_labelled(scene, element, event_columns(events))}, columns.attrs)


def part(scene: Scene, element: Element, dataset: xr.Dataset) -> xr.Dataset:
    """The variables of one element under the element's own names."""
    if len(scene.elements) == 1:
        return dataset
    ending = f".{element.name}"
    names = [name for name in dataset.variables if str(name).endswith(ending)]
    own_variables = dataset[[name for name in names if name in dataset.data_vars]]
    return own_variables.rename(
        {name: str(name).removesuffix(ending) for name in (*names, *own_variables.dims) if name not in _SHARED}
    )


def with_part(scene: Scene, element: Element, dataset: xr.Dataset, data: xr.Dataset) -> xr.Dataset:
    """The dataset with the variables of one element replaced by those of ``data``, the result of :func:`part`."""
    if len(scene.elements) == 1:
        return data
    names = [*data.data_vars, *data.dims]
    labelled = data.rename({name: scene.label(element, str(name)) for name in names if name not in _SHARED})
    return dataset.drop_vars(list(labelled.data_vars)).assign(labelled.data_vars)


def observe(scene: Scene, dataset: xr.Dataset) -> dict[str, FloatArray]:
    """Values of every observable that the run determines, by name in the scene."""
    return {
        scene.label(element, name): values
        for element in scene.elements
        for name, values in element.observe(part(scene, element, dataset)).items()
    }


def scales(scene: Scene, truth: xr.Dataset) -> dict[str, float]:
    """Size of each observable in the truth, but at least its floor; relative tolerances refer to it.

    That of the times of events is the time that the truth spans.
    """
    events = {name: item.unit for name, item in scene.observables.items() if item.role is Role.EVENT}
    time = truth.variables["time"].values
    sizes = {name: float(time[-1] - time[0]) if unit == "s" else 1.0 for name, unit in events.items()}
    sizes |= {
        scene.label(element, name): size
        for element in scene.elements
        for name, size in element.scales(part(scene, element, truth)).items()
    }
    floors = {name: item.floor or 0.0 for name, item in scene.observables.items()}
    return {name: max(size, floors[name]) if np.isfinite(size) else floors[name] for name, size in sizes.items()}


def until_end(scene: Scene, truth: xr.Dataset, runs: Mapping[Key, xr.Dataset]) -> dict[Key, xr.Dataset]:
    """Runs without their samples and events behind the last sample of a truth that ends early; others unchanged."""
    if ended_early(truth) is None:
        return dict(runs)
    last = float(truth.variables["time"].values[-1])
    return {key: _up_to(scene, run, last) for key, run in runs.items()}


def _up_to(scene: Scene, dataset: xr.Dataset, last: float) -> xr.Dataset:
    """A run without what is later than its sample at the time ``last`` [s]."""
    count = int(np.sum(dataset.variables["time"].values <= last))
    cut = dataset.isel(time=slice(count))
    for element in scene.elements:
        data = part(scene, element, cut)
        if "event_time" in data:
            cut = with_part(scene, element, cut, data.isel(event=data["event_time"].to_numpy() <= last))
    return cut


def before_end(scene: Scene, truth: xr.Dataset) -> xr.Dataset:
    """A truth that ends early, without the events behind its last sample; any other unchanged."""
    return until_end(scene, truth, {0: truth})[0]


def off_impacts(scene: Scene, truth: xr.Dataset, runs: Mapping[Key, xr.Dataset]) -> dict[Key, xr.Dataset]:
    """Runs up to the end of the truth, with its values where a sample lies on an impact, of all that has two there.

    Which of them a run has hangs on its last digits. Places and orientations have one, and are the run's own, as is a
    velocity or energy far from what the truth has at that sample and beside it. The first sample stays, and all
    do where most lie on impacts, as of a ball that bounces in time with the samples: else nothing would be judged.
    """
    runs = until_end(scene, truth, runs)
    on = impact_samples(scene, truth)
    on[-1:] |= ended_early(truth) is not None  # a step to there may reach over the end, as over an impact
    if not on.any() or np.mean(on) >= 0.5:
        return dict(runs)
    return {key: _of_either_side(scene, truth, run, np.flatnonzero(on)) for key, run in runs.items()}


def impact_samples(scene: Scene, truth: xr.Dataset) -> npt.NDArray[np.bool_]:
    """Samples of a truth that lie on an impact, where a velocity has two values, shape (time,); never the first."""
    times = truth.variables["time"].values
    happened = [event for element in scene.elements for event in events_of(part(scene, element, truth))]
    hits = np.array([event.time for event in happened if event.kind in JUMPS])
    near = _ON_IMPACT * float(np.max(np.diff(times), initial=0.0))
    on = np.any(np.abs(times[:, None] - hits) <= near, axis=1)
    on[:1] = False
    return np.asarray(on)


def _of_either_side(scene: Scene, truth: xr.Dataset, run: xr.Dataset, on: npt.NDArray[np.intp]) -> xr.Dataset:
    """The run with the truth's values at the samples ``on`` impacts, where its own may be those of either side."""
    indices, run_variables, true_variables = on[on < run.sizes["time"]], run.variables, truth.variables
    last = truth.sizes["time"] - 1
    variables = {}
    for name in map(str, run.data_vars):
        variable, item = run_variables[name], scene.observables.get(name)
        reaction = item is not None and item.role is Role.REACTION
        if name not in true_variables or variable.dims[:1] != ("time",) or variable.dtype.kind != "f":
            continue
        if variable.shape[1:] != true_variables[name].shape[1:]:  # a user's file
            continue
        if true_variables[name].attrs.get("units") in CONTINUOUS and not reaction:
            continue
        true = true_variables[name].values
        around = np.stack([true[indices - 1], true[indices], true[np.minimum(indices + 1, last)]])
        low, high = around.min(axis=0), around.max(axis=0)
        inside = (variable.values[indices] >= 2 * low - high) & (variable.values[indices] <= 2 * high - low)
        values = variable.values.copy()
        values[indices] = np.where(
            (reaction | inside) & np.isfinite(true[indices]), true[indices], variable.values[indices]
        )
        variables[name] = (variable.dims, values, variable.attrs)
    return run.assign(variables)


def shared_events(
    scene: Scene, truth: xr.Dataset, runs: Mapping[Key, xr.Dataset]
) -> tuple[xr.Dataset, dict[Key, xr.Dataset]]:
    """Truth and runs without the events at the end of the time that only some of them reached.

    Where all surplus events lie within one sampling interval, and within the widest bracket of an event, from the last
    sample, the others would have had them a moment later. The widest bracket that is left out of a run remains in its
    attributes.
    """
    everything, times = [truth, *runs.values()], truth.variables["time"].values
    for element in scene.elements:
        parts = [part(scene, element, item) for item in everything]
        events = [events_of(run_part) for run_part in parts]
        fewest = min(map(len, events))
        late = np.array([event.time for run_events in events for event in run_events[fewest:]])
        if not late.size:
            continue
        widest = max(event.time_high - event.time_low for run_events in events for event in run_events)
        room = min(widest, float(np.max(np.diff(times), initial=0.0)))
        if not np.all(np.abs(late - times[-1]) <= room):
            continue
        for number, run_part in enumerate(parts):
            if left_out := events[number][fewest:]:
                open_ = max(event.time_high - event.time_low for event in left_out)
                cut = with_part(scene, element, everything[number], run_part.isel(event=slice(fewest)))
                everything[number] = cut.assign_attrs({LEFT_OUT: max(open_, cut.attrs.get(LEFT_OUT, 0.0))})
    return everything[0], dict(zip(runs, everything[1:], strict=True))


def common_span(
    scene: Scene, truth: xr.Dataset, runs: Mapping[Key, xr.Dataset]
) -> tuple[xr.Dataset, dict[Key, xr.Dataset]]:
    """Truth and runs cut to the time in which they are comparable for every element (:class:`WatchesRuns`).

    Samples on an impact may be of either side (:func:`off_impacts`), and events at the end that only some have are
    left out (:func:`shared_events`). The element whose comparable time ends first ends it for all. Only that element
    keeps its events after the last sample; later events of the other elements are dropped.
    """
    truth, runs = shared_events(scene, truth, off_impacts(scene, truth, runs))
    spans = {}
    for element in scene.elements:
        if isinstance(element, WatchesRuns):
            data = part(scene, element, truth)
            true, shorter = element.common_span(data, {key: part(scene, element, run) for key, run in runs.items()})
            if true is not data:
                spans[element.name] = true, shorter
    if not spans:
        return truth, dict(runs)
    count = min(true.sizes["time"] for true, _ in spans.values())
    end = float(truth["time"][count - 1])
    ending = {
        name
        for name, (true, shorter) in spans.items()
        if true.sizes["time"] == count and any(event.time > end for run in shorter.values() for event in events_of(run))
    }

    def cut(dataset: xr.Dataset, parts: Mapping[str, xr.Dataset]) -> xr.Dataset:
        span = dataset.isel(time=slice(count))
        for element in scene.elements:
            data = parts.get(element.name, part(scene, element, dataset)).isel(time=slice(count))
            if len(scene.elements) > 1 and element.name not in ending and "event_time" in data:
                data = data.isel(event=data["event_time"].to_numpy() <= end)
            span = with_part(scene, element, span, data)
        return span

    own_truths = {name: true for name, (true, _) in spans.items()}
    own_runs = {key: {name: shorter[key] for name, (_, shorter) in spans.items()} for key in runs}
    return cut(truth, own_truths), {key: cut(run, own_runs[key]) for key, run in runs.items()}
