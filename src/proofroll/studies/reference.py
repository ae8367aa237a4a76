"""The truth of one scene, with everything that an engine's trajectory is held against."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from proofroll.agreement import Doubt
from proofroll.events import events_of
from proofroll.metrics import Observable, observables, scales
from proofroll.scene import Scene
from proofroll.surfaces import FloatArray
from proofroll.trajectory import read

if TYPE_CHECKING:
    import xarray as xr

# Observables that hang on when slip begins.
OF_EVENTS = frozenset({"first_slip", "event_order", "event_times"})
# Observables that are judged even where the time of slip is ill-posed: they hold on every path.
_EVERYWHERE = frozenset({"energy_balance", "force_audit", "gap", "creep"})


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
        """Whether the time of the first slip hangs on less than the parameters are known to."""
        onset = json.loads(self.dataset.attrs.get("onset", "{}"))
        return bool(onset.get("verdict") == "ill-posed")

    def shared(self, routes: Collection[str]) -> str:
        """A sentence on which of the truth's two routes is among ``routes``, and what checks it; empty if none is."""
        names = {key: str(self.dataset.attrs.get(key, "")) for key in ("route", "second_route")}
        own = [key for key, name in names.items() if re.split(r"[,(]", name)[0].strip() in routes]
        if not own:
            return ""
        others = [name for key, name in names.items() if key not in own]
        checked = f"only {others[0]} checks both" if others else "nothing checks both"
        return f"rests on the same equations as the truth itself ({names[own[0]]}): {checked}"

    def doubt(self, name: str) -> Doubt:
        """What is left to be judged of an observable where the time of the first slip is ill-posed."""
        if not self.ill_posed or name in _EVERYWHERE:
            return Doubt.NONE
        return Doubt.EVERYTHING if name in OF_EVENTS else Doubt.DIFFERENCES

    def scale(self, name: str) -> float | None:
        """What a percentage of an observable refers to: its size, for the first slip its time; None: nothing."""
        if name == "first_slip" and name in self.curves:
            return next((float(time) for time in self.curves[name].values), None)
        return self.sizes.get(name)

    def observed(self, dataset: xr.Dataset) -> dict[str, Observable]:
        """The observables of an engine's trajectory of this scene."""
        found = observables(self.scene.rolling, dataset)
        if "sticking" in dataset:
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
