"""Cases of stick and slip in the cylinder, with times of events, and runs shared by tests."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping

import xarray as xr

from proofroll.core.time_grid import time_grid
from proofroll.files.scene_file import load_scene
from proofroll.running.recording import record
from proofroll.running.simulation import build

PAPER = {"mu_static": 0.35, "rolling_resistance": 5e-4}
# Blajer's case and others in the cylinder: until when, events [s] and the height at the end [m], from event-driven
# integration of the equations of stick and slip at a tolerance of 1e-12 by two independent methods.
CASES: Mapping[str, tuple[Mapping[str, float], float, tuple[float, ...], float]] = {
    "paper": (PAPER, 4.0, (1.720183172, 2.00812799, 2.44969538), -2.2976587),
    "kinetic": (PAPER | {"mu_kinetic": 0.3}, 4.0, (1.720183172, 2.042487748, 2.231797535), -4.3545715),
    "drops": (PAPER | {"mu_kinetic": 0.25}, 2.2, (1.720183172, 2.086911737, 2.173894213), math.nan),
    "slow": ({"mu_static": 0.35, "speed": 2.0}, 1.0, (0.2166732034,), -1.9496990),
    "slow, resisted": (PAPER | {"speed": 2.0}, 1.0, (0.2072033882,), -2.1426200),
    "recovers": ({"mu_static": 0.15}, 1.0, (0.176667992, 0.412090574, 0.628116731, 0.710311323), math.nan),
    "falls": ({"mu_static": 0.12}, 3.0, (0.14413074,), -2.7869160),
    "holds": ({"mu_static": 0.25}, 0.4, (), math.nan),
}


@functools.cache
def run(case: str, engine: str, until: float, every: float) -> xr.Dataset:
    """Trajectory of an engine for a case, cached for all tests; fails if the run ends early."""
    scene = load_scene("sphere_in_cylinder", **CASES[case][0])
    recording = record(build(scene, engine), scene, time_grid(until, every))
    assert recording.failure is recording.ended is None
    return recording.dataset
