"""Truths of bodies that touch which cost too much for every run of the tests."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.files.scene_file import load_scene
from proofroll.truth.mechanism.switched_truth import truth_of


@pytest.mark.drill
@pytest.mark.timeout(900)  # 30 s of processor time, on a machine that may have much else to do
def test_a_rattleback_reverses_its_spin() -> None:
    """Two routes of a stone that rolls agree until its spin has turned round, and it keeps its energy."""
    mechanism = load_scene("rattleback").elements[0].mechanism  # type: ignore[attr-defined]
    found = truth_of(mechanism, np.array([0.0, 0.69, 0.71]))
    assert np.isinf(found.horizon)
    assert max(float(bar[-1]) for bar in found.bars.values()) < 1e-9
    assert found.events == ()
    start, before, after = found.record.w_WB[:, 0, 2]
    assert start < before < 0 < after  # it reverses at 0.70 s
    energy = found.record.placed(mechanism).energy()
    assert energy == pytest.approx(energy[0], abs=1e-10)
