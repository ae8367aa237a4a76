"""Diagnosis of a scene: samples that bear no evidence."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.dataset import impact_samples
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene


@pytest.mark.nightly_of("after")
@pytest.mark.drill
@pytest.mark.parametrize("side", ["before", "after"])
def test_a_restitution_is_named_whichever_side_of_the_impact_a_sample_shows(side: str) -> None:
    """A run with 0.9 of the restitution has that cause, with either velocity at its sample on the impact."""
    scene, times = load_scene("two_spheres"), np.linspace(0.0, 0.2, 21)
    true = truth(scene, times)
    run = truth(load_scene("two_spheres", restitution=0.72), times).copy(deep=True)
    (on,) = np.flatnonzero(impact_samples(scene, true))
    assert times[on] == pytest.approx(0.1)
    for name in ("v_WB", "w_WB"):
        run[name][on] = run[name].to_numpy()[on - 1 if side == "before" else on + 1]
    (first, *_) = diagnose_scene(scene, [], run, true, 1e-3)
    assert first.cause.says == "restitution of impacts is 0.9 times"
