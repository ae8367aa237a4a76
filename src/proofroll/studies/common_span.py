"""What of a run and of the truth can be held against each other, where a model ends before the scene does."""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING, TypeVar

from proofroll.core.dataset import observe
from proofroll.core.element_abilities import WatchesRuns
from proofroll.studies.reference import Reference

if TYPE_CHECKING:
    import xarray as xr

Key = TypeVar("Key", bound=Hashable)


def common_span(
    reference: Reference, trajectories: Mapping[Key, xr.Dataset]
) -> tuple[Reference, dict[Key, xr.Dataset]]:
    """The truth and the runs as far as they are comparable, as the element says (:class:`WatchesRuns`)."""
    first = reference.scene.elements[0]
    if len(reference.scene.elements) > 1 or not isinstance(first, WatchesRuns):
        return reference, dict(trajectories)
    truth, runs = first.common_span(reference.dataset, trajectories)
    if truth is reference.dataset:
        return reference, runs
    return dataclasses.replace(reference, dataset=truth, curves=observe(reference.scene, truth)), runs
