"""The regime maps that a comparison file asks for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.comparison import Comparison
from proofroll.core.errors import InputError
from proofroll.files.scene_file import load_scene

if TYPE_CHECKING:
    import xarray as xr


def regime_maps(
    comparison: Comparison, workers: int, progress: Callable[[int], None] | None = None
) -> list[xr.Dataset]:
    """One map per value of the rolling resistance, each from runs of the truth.

    Args:
        comparison: with a table ``regimes``.
        workers: processes at once.
        progress: called with the number of runs just finished.

    Raises:
        InputError: the comparison has no such table, or its axes make no sense.
    """
    from proofroll.truth.regimes import regime_map

    wanted = comparison.regimes
    if wanted is None:
        raise InputError(f"{comparison.name}: regimes", "nothing", "the file has no [regimes] table; add one")
    for name, axis in (("speed", wanted.speed), ("mu_static", wanted.mu_static)):
        if axis.count < 1 or not 0 < axis.low <= axis.high:
            raise InputError(
                f"{comparison.name}: regimes.{name}", axis, "give 0 < low <= high and a count of 1 or more"
            )
    speeds = np.linspace(wanted.speed.low, wanted.speed.high, wanted.speed.count)
    frictions = np.linspace(wanted.mu_static.low, wanted.mu_static.high, wanted.mu_static.count)
    return [
        regime_map(
            load_scene(comparison.scene, rolling_resistance=f),
            speeds,
            frictions,
            until=wanted.until,
            workers=workers,
            progress=progress,
        )
        for f in wanted.rolling_resistance
    ]
