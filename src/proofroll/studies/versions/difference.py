"""Differences of the numbers of two runs of one scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.dataset import observe
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.whole_turns import on_turns_of

if TYPE_CHECKING:
    import xarray as xr

# Largest difference, relative to the size of the quantity, that counts as round-off. Another compiler or order of sums
# changes numbers by some 1e-13, solvers of constraints by their tolerances, other physics or methods by far more.
ROUND_OFF = 1e-9


class NumberKind(StrEnum):
    """Kind of difference between the numbers of two runs."""

    SAME_BITS = "same bits"
    ROUND_OFF = "round-off"
    CHANGED = "changed"


@dataclass(frozen=True)
class NumbersApart:
    """Difference of two trajectories, for the observable with the largest relative difference.

    Attributes:
        quantity, unit: of that observable; empty if nothing differs.
        difference: the largest, in its unit.
        relative: difference divided by the observable's size [1].
        kind: of difference.
    """

    quantity: str = ""
    unit: str = ""
    difference: float = 0.0
    relative: float = 0.0
    kind: NumberKind = NumberKind.SAME_BITS


def numbers_apart(
    scene: Scene, data: xr.Dataset, new_data: xr.Dataset, sizes: Mapping[str, float]
) -> list[NumbersApart]:
    """Differences of two runs with samples at the same times, for each observable that differs, the largest first.

    Args:
        scene: of both runs.
        data: earlier run.
        new_data: later run.
        sizes: observable -> its size, to which its difference is relative; by default its largest value.
    """
    differences = []
    values, rivals = observe(scene, data), observe(scene, new_data)
    for name, mine in values.items():
        item, theirs = scene.observables[name], rivals.get(name)
        if theirs is None or item.role not in {Role.MOTION, Role.REACTION} or mine.ndim != theirs.ndim:
            continue
        theirs = on_turns_of(mine, theirs, name, (data, new_data))
        if theirs is None:
            continue
        count = min(len(mine), len(theirs))
        if mine[:count].shape != theirs[:count].shape or np.array_equal(mine[:count], theirs[:count], equal_nan=True):
            continue
        difference = float(np.nanmax(np.abs(mine[:count] - theirs[:count]), initial=0.0))
        relative = difference / (sizes.get(name) or float(np.nanmax(np.abs(mine), initial=0.0)) or 1.0)
        kind = NumberKind.ROUND_OFF if relative <= ROUND_OFF else NumberKind.CHANGED  # NaN counts as a difference
        differences.append(
            NumbersApart(quantity=name, unit=item.unit, difference=difference, relative=relative, kind=kind)
        )
    return sorted(differences, key=lambda apart: -apart.relative if apart.relative >= 0 else -math.inf)
