"""Couplings of any number of joints, which may be all that gives a joint inertia."""

from __future__ import annotations

import numpy as np
import pytest
from pulleys import MASSES, accelerations, massless_pulley, one_rope

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.reading.assembly import check_start
from proofroll.truth.smooth.smooth_truth import find_truth


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("massless pulley")
@pytest.mark.parametrize("mechanism", [one_rope(), massless_pulley()], ids=["one rope", "massless pulley"])
def test_weights_on_pulleys_fall_as_a_textbook_says(mechanism: Mechanism) -> None:
    """Weights on a movable pulley move with their closed accelerations, and the rope has its tension."""
    check_start(mechanism)
    truth = find_truth(mechanism, np.array([0.0, 0.5]))
    heights = truth.record.placed(mechanism).p_WB[-1, [mechanism.body_index[f"w{k}"] for k in range(3)], 2]
    expected = accelerations()
    assert heights == pytest.approx([0.125 * a for a in expected], abs=1e-13)
    assert truth.record.named[-1, 0] == pytest.approx(MASSES[0] * (expected[0] + 9.81), rel=1e-13)
