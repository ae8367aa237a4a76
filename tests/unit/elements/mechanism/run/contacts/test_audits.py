"""Audits of contacts: what a right run leaves."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.files.scene_file import load_scene


@pytest.mark.drill
def test_energy_of_a_resisted_slip_balances() -> None:
    """Rolling resistance of a ball that slips acts against its turning, not against the velocity of its centre."""
    scene = load_scene("slide_to_roll", side_spin=40, normal_spin=9, rolling_resistance=5e-3)
    curves = the_mechanism(scene).observe(truth(scene, np.linspace(0, 0.1, 31)))
    assert np.abs(curves["energy_balance"]).max() < 1e-4  # along the centre's velocity: 0.1 J
