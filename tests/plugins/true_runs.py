"""Cached truths for tests of engines: each costs more than most runs of an engine."""

from __future__ import annotations

import xarray as xr

from proofroll.core.scene import Scene
from proofroll.running.simulation import simulate

_runs: dict[tuple[str, float, float], xr.Dataset] = {}


def true_run(scene: Scene, until: float, every: float) -> xr.Dataset:
    """Truth of a scene up to ``until`` [s], sampled each ``every`` [s]; computed once in a process."""
    key = scene.digest, until, every
    if key not in _runs:
        _runs[key] = simulate(scene, "truth", until=until, every=every)
    return _runs[key]
