"""How far the truth and runs of a scene are comparable, where a model ends before the scene does."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING, TypeVar

from proofroll.core.dataset import part, with_part
from proofroll.core.element_abilities import WatchesRuns
from proofroll.core.events import events_of
from proofroll.core.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

Key = TypeVar("Key", bound=Hashable)


def common_span(
    scene: Scene, truth: xr.Dataset, runs: Mapping[Key, xr.Dataset]
) -> tuple[xr.Dataset, dict[Key, xr.Dataset]]:
    """The truth and runs of it as far as they are comparable for every element (:class:`WatchesRuns`).

    A run ends for all elements where one of them ends it, with an event of its own after the last sample; of the others
    what happens later is then not compared.
    """
    spans = {}
    for element in scene.elements:
        if isinstance(element, WatchesRuns):
            own = part(scene, element, truth)
            true, shorter = element.common_span(own, {key: part(scene, element, run) for key, run in runs.items()})
            if true is not own:
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
        found = dataset.isel(time=slice(count))
        for element in scene.elements:
            own = parts.get(element.name, part(scene, element, dataset)).isel(time=slice(count))
            if len(scene.elements) > 1 and element.name not in ending and "event_time" in own:
                own = own.isel(event=own["event_time"].to_numpy() <= end)
            found = with_part(scene, element, found, own)
        return found

    own_truths = {name: true for name, (true, _) in spans.items()}
    own_runs = {key: {name: shorter[key] for name, (_, shorter) in spans.items()} for key in runs}
    return cut(truth, own_truths), {key: cut(run, own_runs[key]) for key, run in runs.items()}
