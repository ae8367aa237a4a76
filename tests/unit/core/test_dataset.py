"""Sentences about a true trajectory."""

from __future__ import annotations

import pytest
import xarray as xr

from proofroll.core.dataset import ENDED, ENDS, truth_message


@pytest.mark.parametrize(("end", "says"), [(0.0, "t = 0 s: it"), (0.15, "t = 0.15 s, behind its 2 samples: it")])
def test_a_truth_that_ends_at_its_start_has_no_samples_before(end: float, says: str) -> None:
    """The sentence on an early end counts the samples before it, where there are any."""
    assert says in truth_message(xr.Dataset({}, {"time": [0.0, 0.1]}, {ENDS: end, ENDED: "it tears"}))
