"""Stops of joints by Pinocchio's impulses."""

import numpy as np
import pytest

from proofroll.running.simulation import simulate


@pytest.mark.drill
def test_no_step_throws_up_what_has_sunk_into_a_stop() -> None:
    """The place on a stop converges with the step, taken at its middle: it is no floor of millimetres."""
    engine = "pinocchio[formulation=impulses,preset=tuned,dt=2e-4]"
    place, true = (simulate("stop", each, until=0.5, every=0.01).positions.to_numpy() for each in (engine, "truth"))
    assert np.abs(place - true).max() < 1e-3
