"""What of a run and of the truth can be held against each other where the ball leaves the wall."""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from proofroll.events import left_at
from proofroll.metrics import observables
from proofroll.studies.reference import Reference

if TYPE_CHECKING:
    import xarray as xr

# What there is on the wall only.
_ON_WALL = ("N", "F2", "F3", "needed_friction", "slip2", "slip3", "gap")

Key = TypeVar("Key", bound=Hashable)


def common_span(
    reference: Reference, trajectories: Mapping[Key, xr.Dataset]
) -> tuple[Reference, dict[Key, xr.Dataset]]:
    """The truth and the runs up to the end of the shortest, and what is on the wall up to the first lift-off of any.

    A model that holds the ball on the wall ends its run where the ball leaves it. That is no fault where the truth's
    ball leaves the wall too, no more than one sample later; a run that ends before is left too short, and differs.
    """
    leaves, true = left_at(reference.dataset), reference.dataset["time"].to_numpy()
    if not np.isfinite(leaves):
        return reference, dict(trajectories)
    fewest = int(np.searchsorted(true, leaves)) - 1  # samples on the wall, less one
    count = min([len(true), *(run.sizes["time"] for run in trajectories.values() if run.sizes["time"] >= fewest)])
    until = min([leaves, *(left_at(run) for run in trajectories.values())])

    def cut(dataset: xr.Dataset) -> xr.Dataset:
        short = dataset.isel(time=slice(count))
        there = [name for name in _ON_WALL if name in short]
        on_wall = {
            name: short[name].where(short["time"] < until, 0.0).assign_attrs(short[name].attrs) for name in there
        }
        return short.assign(on_wall)

    truth = cut(reference.dataset)
    short = dataclasses.replace(reference, dataset=truth, curves=observables(reference.scene.rolling, truth))
    return short, {key: cut(run) for key, run in trajectories.items()}
