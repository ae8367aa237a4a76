"""Values of a run that are looked at beside those that tolerances name."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.files.scene_file import load_scene
from proofroll.studies.judging.reference import Reference
from proofroll.studies.judging.run_values import rates_remark

TIMES = np.linspace(0.0, 1.0, 11)


def reference() -> Reference:
    """A reference with velocities of the one body of a scene."""
    v = np.stack([np.cos(TIMES), np.sin(TIMES), 0 * TIMES], axis=1)[:, None]
    dataset = xr.Dataset({"v_WB": (("time", "body", "xyz"), v, {"units": "m/s"})})
    return Reference(load_scene("pendulum"), dataset, {"v_WB": v}, {"v_WB": 1.0})


@pytest.mark.parametrize("factor", [0.0, -1.0, 100.0, np.nan])
def test_velocities_that_contradict_the_motion_are_remarked(factor: float) -> None:
    """Velocities that no tolerance names are named where they are frozen, reversed, huge or no numbers."""
    held = reference()
    curves = {"v_WB": factor * held.curves["v_WB"]}
    assert rates_remark(held, curves, set()).startswith("v_WB does not belong to this motion: off by ")
    assert rates_remark(held, curves, {"v_WB"}) == "", "a tolerance judges them"


def test_velocities_beside_an_impact_are_not_remarked() -> None:
    """A velocity that is wrong at few samples, as of an impact a step late, contradicts no motion."""
    held = reference()
    values = held.curves["v_WB"].copy()
    values[3:5] *= -1.0
    assert rates_remark(held, {"v_WB": values}, set()) == ""
