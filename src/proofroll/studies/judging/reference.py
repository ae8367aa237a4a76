"""The truth of one scene, with everything that an engine's trajectory is held against."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.beside_events import beside_events
from proofroll.core.dataset import Key, common_span, observe, part, scales
from proofroll.core.element_abilities import KnowsAnotherScene
from proofroll.core.events import EVENT_ORDER, Event, events_of
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.verdict import Doubt

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Reference:
    """The truth with what is derived from it.

    Attributes:
        scene: with its numbers.
        dataset: the true trajectory.
        curves: values of its observables.
        sizes: scale of each observable.
    """

    scene: Scene
    dataset: xr.Dataset
    curves: dict[str, FloatArray]
    sizes: dict[str, float]

    @classmethod
    def of(cls, scene: Scene, dataset: xr.Dataset) -> Self:
        """Reference from a trajectory of the truth."""
        return cls(scene, dataset, observe(scene, dataset), scales(scene, dataset))

    def common_span(self, trajectories: Mapping[Key, xr.Dataset]) -> tuple[Reference, dict[Key, xr.Dataset]]:
        """The truth and runs as far as they are comparable, where a model ends before the scene does (WatchesRuns)."""
        truth, runs = common_span(self.scene, self.dataset, trajectories)
        if truth is self.dataset:
            return self, runs
        return replace(self, dataset=truth, curves=observe(self.scene, truth)), runs

    def another_scene(self, lines: Sequence[Mapping[str, Any]]) -> str | None:
        """Reason that a model with this certificate is of another kind, as one clause; None: it is not."""
        for element in self.scene.elements:
            if isinstance(element, KnowsAnotherScene):
                why = element.another_scene(lines, part(self.scene, element, self.dataset))
                if why is not None:
                    return why
        return None

    @property
    def ill_posed(self) -> bool:
        """True if the result is sensitive below parameter precision."""
        return bool(self.dataset.attrs.get("ill_posed"))

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
        """Part of an observable that cannot be judged where the time of the first slip is ill-posed."""
        item = self.scene.observables[name]
        if not self.ill_posed or not item.hangs_on_events:
            return Doubt.NONE
        return Doubt.EVERYTHING if item.role == Role.EVENT else Doubt.DIFFERENCES

    def scale(self, name: str) -> float | None:
        """Size that a percentage of an observable refers to: its scale, for an event its time; None: nothing."""
        if self.scene.observables[name].role == Role.EVENT and name in self.curves:
            return next((float(time) for time in self.curves[name]), None)
        return self.sizes.get(name)

    def true(self, name: str, values: FloatArray) -> tuple[FloatArray, float]:
        """True values of an observable with ``values`` from an engine, and their error bar; infinite: it has none."""
        item = self.scene.observables[name]
        if item.name == EVENT_ORDER:
            return np.zeros(1), 0.0
        if item.role == Role.EVENT:
            return self.curves[name], max((event.time_high - event.time_low for event in self.events), default=0.0)
        known = self.curves.get(name)
        if known is None:  # as a force that is not determinate all the time
            return np.full_like(values, np.nan), np.inf
        if item.role != Role.RESIDUAL:
            return known, float(self.dataset[name].attrs["error_bar"])
        # Zero for a perfect run: what is left on the truth is what the measurement itself cannot resolve.
        return np.zeros_like(values), float(np.max(np.abs(known), initial=0.0))

    def magnitude(self, name: str) -> float:
        """Size of the numbers whose round-off an observable has: its own, or those whose small difference it is."""
        numbers = [self.curves.get(name, np.zeros(0))]
        for element in self.scene.elements:
            for item in element.observables:
                if item.difference_of and self.scene.label(element, item.name) == name:
                    numbers.append(part(self.scene, element, self.dataset)[item.difference_of].to_numpy())
        return max(self.scale(name) or 0.0, *(float(np.max(np.abs(values), initial=0.0)) for values in numbers))

    def own_bar(self, name: str, dataset: xr.Dataset) -> float:
        """Error bar of a run for an observable: half the width of its widest event."""
        item = self.scene.observables[name]
        if item.role != Role.EVENT or item.name == EVENT_ORDER:
            return 0.0
        return max((event.time_high - event.time_low for event in self.events_of(dataset)), default=0.0) / 2

    def beside(self, name: str, values: FloatArray, dataset: xr.Dataset, step: float | None) -> float:
        """Change of an observable's values of a run by one step [s] beside its events.

        Where a run tells no events they are the true ones. ``step``: None: it adapts, and ends at samples.
        """
        if self.scene.observables[name].role == Role.EVENT:
            return 2 * self.own_bar(name, dataset)
        times = self.dataset["time"].to_numpy()
        times = times[len(times) - len(values) :] if len(values) <= len(times) else times
        if len(times) != len(values):
            return 0.0  # what has a time of its own for each value
        told = any("event_kind" in part(self.scene, item, dataset) for item in self.scene.elements)
        events = self.events_of(dataset) if told else self.events
        widest = max((event.time_high - event.time_low for event in events), default=0.0)
        late = min(widest if told else 2 * self.sampled_bar, step or np.inf)
        return beside_events(times, values, [event.time for event in events], late)

    @property
    def sampled_bar(self) -> float:
        """Error bar of the time of an event between samples [s]: half the longest interval between two."""
        return float(np.max(np.diff(self.dataset["time"].to_numpy()), initial=0.0)) / 2

    @property
    def events(self) -> list[Event]:
        """Events of all elements."""
        return self.events_of(self.dataset)

    def events_of(self, dataset: xr.Dataset) -> list[Event]:
        """Events of all elements in another run."""
        return [event for item in self.scene.elements for event in events_of(part(self.scene, item, dataset))]
