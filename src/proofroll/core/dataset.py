"""The result of a run: one xarray.Dataset with units on every variable, made of the parts that its elements give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element import Element
from proofroll.core.events import Event, with_events
from proofroll.core.scene import Scene
from proofroll.core.several import AnySample, sample_of

if TYPE_CHECKING:
    import xarray as xr

# Dimensions that the variables of all elements share; every other is an element's own.
_SHARED = frozenset({"time", "xyz", "wxyz"})


def from_samples(
    scene: Scene,
    times: FloatArray,
    samples: Sequence[AnySample],
    between: Mapping[float, AnySample] = MappingProxyType({}),
) -> xr.Dataset:
    """The trajectory of a run.

    Args:
        scene: the scene that was run.
        times: of the samples [s], shape (time,).
        samples: one per time; fewer if the run ended early.
        between: samples off the grid, by time [s].
    """
    reached = np.asarray(times[: len(samples)], dtype=np.float64)
    parts = {
        element.name: element.dataset(
            reached,
            [sample_of(scene, element, sample) for sample in samples],
            {time: sample_of(scene, element, sample) for time, sample in between.items()},
        )
        for element in scene.elements
    }
    return joined(scene, parts)


def joined(scene: Scene, parts: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """One dataset of those of the scene's elements, by their names."""
    import xarray as xr

    named = []
    for element in scene.elements:
        part = parts[element.name]
        own = [name for name in (*part.variables, *part.dims) if name not in _SHARED]
        named.append(part.rename({name: scene.label(element, str(name)) for name in dict.fromkeys(own)}))
    whole = xr.merge(named, combine_attrs="drop_conflicts") if len(named) > 1 else named[0]
    return whole.assign_attrs(scene=scene.name, scene_digest=scene.digest)


def add_events(scene: Scene, element: Element, dataset: xr.Dataset, events: Sequence[Event]) -> xr.Dataset:
    """The dataset with the events of an element."""
    import xarray as xr

    made = with_events(xr.Dataset(), events)
    named = made.rename({name: scene.label(element, str(name)) for name in (*made.data_vars, *made.dims)})
    return dataset.assign(named.variables)


def part(scene: Scene, element: Element, dataset: xr.Dataset) -> xr.Dataset:
    """The variables of one element, under the names that it gave them."""
    if len(scene.elements) == 1:
        return dataset
    ending = f".{element.name}"
    own = [name for name in dataset.variables if str(name).endswith(ending)]
    found = dataset[[name for name in own if name in dataset.data_vars]]
    return found.rename({name: str(name).removesuffix(ending) for name in (*own, *found.dims) if name not in _SHARED})


def observe(scene: Scene, dataset: xr.Dataset) -> dict[str, FloatArray]:
    """Values of every observable that the run allows, by name in the scene."""
    return {
        scene.label(element, name): values
        for element in scene.elements
        for name, values in element.observe(part(scene, element, dataset)).items()
    }


def scales(scene: Scene, truth: xr.Dataset) -> dict[str, float]:
    """Size of each observable in the truth, never below its floor, to which a relative tolerance refers."""
    sizes = {
        scene.label(element, name): size
        for element in scene.elements
        for name, size in element.scales(part(scene, element, truth)).items()
    }
    floors = {name: item.floor or 0.0 for name, item in scene.observables.items()}
    return {name: max(size, floors[name]) if np.isfinite(size) else floors[name] for name, size in sizes.items()}
