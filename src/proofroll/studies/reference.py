"""The truth of one scene, with everything that an engine's trajectory is held against."""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from proofroll.events import events_of
from proofroll.metrics import Observable, observables, scales
from proofroll.scene import Scene
from proofroll.surfaces import FloatArray
from proofroll.trajectory import read

if TYPE_CHECKING:
    import xarray as xr

# Observables that hang on when slip begins.
OF_EVENTS = frozenset({"first_slip", "event_order", "event_times"})


@dataclass(frozen=True)
class Reference:
    """The truth with what is derived from it.

    Attributes:
        scene: with its numbers.
        dataset: the true trajectory.
        curves: its observables.
        sizes: scale of each observable.
    """

    scene: Scene
    dataset: xr.Dataset
    curves: dict[str, Observable]
    sizes: dict[str, float]

    @classmethod
    def read(cls, scene: Scene, path: Path) -> Self:
        """From a stored trajectory of the truth."""
        dataset = read(path)
        return cls(scene, dataset, observables(scene.rolling, dataset), scales(scene.rolling, dataset))

    @property
    def ill_posed(self) -> bool:
        """Whether the time of the first slip, or what follows it, hangs on less than the parameters are known to."""
        onset = json.loads(self.dataset.attrs.get("onset", "{}"))
        return bool(onset.get("verdict") == "ill-posed" or "ill_posed" in self.dataset.attrs)

    def scale(self, name: str) -> float | None:
        """What a percentage of an observable refers to: its size, for the first slip its time; None: nothing."""
        if name == "first_slip" and name in self.curves:
            return next((float(time) for time in self.curves[name].values), None)
        return self.sizes.get(name)

    def observed(self, dataset: xr.Dataset) -> dict[str, Observable]:
        """The observables of an engine's trajectory of this scene."""
        found = observables(self.scene.rolling, dataset)
        if "event_kind" in dataset or "event_kind" in self.dataset:
            found["event_order"] = event_order(dataset, self.dataset)
        return found

    def true(self, name: str, curve: Observable) -> tuple[FloatArray, float]:
        """The true values of an observable, and their error bar."""
        if name == "event_order":
            return np.zeros(1), 0.0
        values = self.curves[name].values
        if name in OF_EVENTS:
            events = events_of(self.dataset)
            return values, max((event.time_high - event.time_low for event in events), default=0.0)
        if name == "slip" and "sticking" in self.dataset:
            return values, float(np.hypot(*(self.dataset[f"slip{i}"].attrs["error_bar"] for i in (2, 3))))
        if name not in self.dataset or name == "gap":
            # Zero for a perfect run: what is left on the truth is what the measurement itself cannot resolve.
            return np.zeros_like(curve.values), float(np.max(np.abs(values), initial=0.0))
        return values, float(self.dataset[name].attrs["error_bar"])


def event_order(dataset: xr.Dataset, truth: xr.Dataset) -> Observable:
    """How many of the events are of another kind than the truth's, or missing, or too many."""
    kinds = itertools.zip_longest(*([event.kind for event in events_of(item)] for item in (dataset, truth)))
    return Observable("event_order", "events", np.array([float(sum(a != b for a, b in kinds))]))
