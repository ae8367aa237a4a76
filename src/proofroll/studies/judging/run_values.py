"""Values of a run prepared for comparison with the truth: same turns, signs of quaternions and times."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, largest_difference, largest_magnitude, magnitudes
from proofroll.core.comparison import Tolerance
from proofroll.core.dataset import BETWEEN, observe, part
from proofroll.core.events import EVENT_ORDER, events_of
from proofroll.core.number_format import number
from proofroll.core.observable import Role
from proofroll.core.verdict import RunCurve
from proofroll.core.whole_turns import on_turns_of
from proofroll.studies.judging.reference import Reference

if TYPE_CHECKING:
    import xarray as xr

CONTRADICTS = 0.1  # part of their size by which velocities are off at most samples of another motion


def always_judged(reference: Reference, names: Iterable[str]) -> dict[str, Tolerance]:
    """Tolerances of the observables that are judged even without one in the file; only differences are shown."""
    items = {name: reference.scene.observables[name] for name in names if reference.scene.observables[name].always}
    end = Tolerance(float(reference.dataset.variables["time"].values[-1]), False, "s")
    return {name: end if item.role is Role.EVENT else Tolerance(item.always, True) for name, item in items.items()}


def contradicted_rates(
    reference: Reference, variables: Mapping[Any, Any], judged: Container[str]
) -> Iterator[tuple[str, float]]:
    """Velocities that no tolerance judges and that contradict the motion, each with its error at half of the samples.

    Velocities of a right motion are right: at most samples they differ from the true ones by less than ``CONTRADICTS``
    of their size. Impacts, which an engine may have a step late, are at few samples.

    Args:
        reference: the truth.
        variables: of the run, arrays by name.
        judged: names that a tolerance judges.
    """
    scene = reference.scene
    for name in [scene.label(element, key) for element in scene.elements for key in element.sample_type.widths]:
        exact = reference.dataset.variables.get(name)
        if exact is None or name not in variables or name in judged:
            continue
        true, run, vectors = exact.values, np.asarray(variables[name]), reference.vectors(name)
        known_at = np.isfinite(true).reshape(len(true), -1).all(axis=1)
        if run.shape != true.shape or not known_at.any() or not str(exact.attrs.get("units", "")).endswith("/s"):
            continue
        true, run = true[known_at], run[known_at]
        size = reference.sizes.get(name) or largest_magnitude(true, vectors) or 1.0
        apart = float(np.median(magnitudes(run - true, vectors).max(axis=1, initial=0.0)))
        if not apart <= CONTRADICTS * size:
            yield name, apart


def rates_remark(reference: Reference, variables: Mapping[Any, Any], judged: Container[str]) -> str:
    """Clause on the first of the :func:`contradicted_rates`; empty if there are none."""
    for name, apart in contradicted_rates(reference, variables, judged):
        unit = str(reference.dataset.variables[name].attrs["units"])
        return f"{name} does not belong to this motion: off by {number(apart)} {unit} at half of the samples"
    return ""


def observables_of(reference: Reference, dataset: xr.Dataset) -> dict[str, FloatArray]:
    """Observables of an engine's trajectory, by name.

    A force that is not determinate all the time is zero where it is not, as its true values are.
    """
    curves, variables = observe(reference.scene, dataset), dataset.variables
    for name, determinate in reference.determinate.items():
        curves.pop(name, None)
        values = variables[name].values[1:] if name in variables else np.zeros(0)
        if values.shape[1:] == determinate.shape[1:] and len(values) <= len(determinate):
            masked = np.where(determinate[: len(values)], values, 0.0)
            curves |= {} if np.any(np.isnan(masked)) else {name: masked}
    for element in reference.scene.elements:
        run_part, true = part(reference.scene, element, dataset), part(reference.scene, element, reference.dataset)
        if "event_kind" in run_part:  # the run reports events
            curves[reference.scene.label(element, EVENT_ORDER)] = event_order(run_part, true)
    curves = {name: values for name, values in curves.items() if name in reference.scene.observables}
    for name in [name for name in curves if name in variables and variables[name].dims[-1:] == ("wxyz",)]:
        values = curves.pop(name)
        if name in reference.curves:  # the scene asks for orientations
            curves[name] = turned_alike(values, reference.curves[name])
    turned = {name: on_true_turns(reference, name, values, dataset) for name, values in curves.items()}
    return {name: values for name, values in turned.items() if values is not None}


def laws_behind_the_end(reference: Reference, dataset: xr.Dataset) -> dict[str, FloatArray]:
    """Residuals of laws that hold for any motion, of a whole run whose truth ends early; else nothing."""
    if not reference.ended:
        return {}
    observables = reference.scene.observables
    laws = {name for name, item in observables.items() if item.role is Role.RESIDUAL and not item.hangs_on_events}
    return {name: values for name, values in observe(reference.scene, dataset).items() if name in laws}


def on_true_turns(reference: Reference, name: str, values: FloatArray, dataset: xr.Dataset) -> FloatArray | None:
    """Values of a variable with the truth's whole turns, where they are uncertain; None: no comparison is possible.

    See :func:`proofroll.core.whole_turns.on_turns_of`. A run that ended early has fewer values than the truth.
    """
    true = reference.curves.get(name)
    if true is None and name in reference.dataset:
        true = reference.dataset[name].to_numpy()
    true_turns = None if true is None else true[: len(values)]
    return on_turns_of(true_turns, values, name, (dataset, reference.dataset))


def values_off_grid(reference: Reference, name: str, dataset: xr.Dataset) -> tuple[FloatArray, FloatArray] | None:
    """Values of :func:`off_grid` with their true values, where the truth knows them; None: nothing to compare."""
    triple = off_grid(reference, name, dataset)
    if triple is None:
        return None
    finite = np.isfinite(triple[2])
    run, true = (np.where(finite, values, 0.0) for values in triple[1:])
    return run, true


def off_grid(reference: Reference, name: str, dataset: xr.Dataset) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Times [s] of samples off the grid, an observable or state there, and its true values; None: nothing to compare.

    Sampling intervals with an event of the truth are left out, and the interval beside it in which the run has that
    event: for up to a step of the engine its forces may be those from before the event.
    """
    name_between, item = f"{BETWEEN}.{name}", reference.scene.observables.get(name)
    if name_between not in dataset or name_between not in reference.dataset:
        return None
    run, truth = dataset.variables, reference.dataset.variables  # indexing a dataset would copy arrays
    times, true_times, grid = run[BETWEEN].values, truth[BETWEEN].values, truth["time"].values
    happened, own_events = (
        np.array([event.time for event in reference.events_of(run_or_truth)])
        for run_or_truth in (reference.dataset, dataset)
    )
    left_out = np.searchsorted(grid, happened)
    if own_events.size:
        nearest = own_events[np.argmin(np.abs(own_events - happened[:, None]), axis=1)]
        beside = np.clip(np.searchsorted(grid, nearest), left_out - 1, left_out + 1)
        left_out = np.concatenate([left_out, beside])
    alone = ~np.isin(np.searchsorted(grid, times), left_out)
    if item is not None and item.role is Role.REACTION:
        alone &= ~reference.beside_changes(times)
    both = np.isin(times, true_times) & alone & (times < grid[-1])
    times, values, true = (
        times[both],
        run[name_between].values[both],
        truth[name_between].values[np.isin(true_times, times[both])],
    )
    if item is not None and item.role is Role.RESIDUAL:
        return times, values, np.zeros_like(values)
    if run[name_between].dims[-1:] == ("wxyz",):
        values = turned_alike(values, true)
    turned = on_turns_of(true, values, name, (dataset, reference.dataset))
    return None if turned is None else (times, turned, true)


def run_curve(
    reference: Reference, name: str, values: FloatArray, dataset: xr.Dataset, precision: str = "double"
) -> RunCurve:
    """Values of an observable in a run, with the uncertainty of its events, its values off the grid and its size."""
    return RunCurve(
        values,
        own_bar=reference.own_bar(name, dataset),
        sampled_bar=reference.sampled_bar if reference.scene.observables[name].role is Role.EVENT else np.inf,
        bar_of="its sum over the samples" if reference.scene.observables[name].sums_samples else "",
        between=values_off_grid(reference, name, dataset),
        magnitude=reference.magnitude(name),
        precision=precision,
        vectors=reference.vectors(name),
    )


def error(reference: Reference, name: str, values: FloatArray, dataset: xr.Dataset) -> float:
    """Largest distance of an observable from the truth, at the samples and off the grid."""
    apart, vectors = values_off_grid(reference, name, dataset), reference.vectors(name)
    on_grid = largest_difference(values, reference.true(name, values).values, vectors)
    return on_grid if apart is None else max(on_grid, largest_difference(*apart, vectors))


def turned_alike(values: FloatArray, true: FloatArray) -> FloatArray:
    """Quaternions, (time, …, 4), with the signs of the true ones as far as these go: q and -q are one orientation."""
    count = min(len(values), len(true))
    if values.shape[1:] != true.shape[1:]:
        return values
    signs = np.where(np.sum(values[:count] * true[:count], axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return np.concatenate([values[:count] * signs, values[count:]])


def event_order(dataset: xr.Dataset, truth: xr.Dataset) -> FloatArray:
    """Number of events that differ in kind or part from the truth's, are missing or are too many; shape (1,).

    Events at one time may come in another order of their parts. A run need not name them.
    """
    run_events, true = (events_of(item) for item in (dataset, truth))
    kinds = itertools.zip_longest(*([event.kind for event in events] for events in (run_events, true)))
    named, counts = (
        Counter((event.kind, event.name) for event in events if event.name) for events in (run_events, true)
    )
    return np.array([float(max(sum(a != b for a, b in kinds), (named - counts).total() if counts else 0))])
