"""Truth of a motion without switches."""

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.truth.smooth.smooth_truth import _SmoothTruth
from proofroll.truth.truth_of_mechanism import truth_of


@pytest.mark.drill
def test_a_closed_form_is_taken_where_routes_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """No neighbouring motion is integrated of routes that end at a singular pose, before the form that goes on."""
    monkeypatch.delattr(_SmoothTruth, "_nearby")
    found = truth_of(mechanism_named("four_bar"), np.linspace(0.0, 1.0, 3))
    assert found.routes[0].startswith("closed form")
    assert np.isinf(found.end)
