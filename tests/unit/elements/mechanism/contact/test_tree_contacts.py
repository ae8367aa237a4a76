"""Impacts of mechanisms whose bodies form a tree."""

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.elements.mechanism.contact import tree_contacts
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics


def test_an_impact_is_the_same_without_its_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    """Velocities and impulses of one contact are those to the last bit, and changed loads are not looked at."""
    mechanism = mechanism_named("spinning_bounce")
    dynamics, (q, v) = ContactDynamics(mechanism), mechanism.start()
    state = dynamics.at(q, v)
    falling = v - 3.0 * state.touching[0].normal @ state.J[0]
    half = np.array([0.5])
    velocities, impulses, _ = dynamics.struck(q, falling, [0], half)
    monkeypatch.delattr(tree_contacts, "robust_forces")
    alone = dynamics.struck(q, falling, [0], half, margin=False)
    np.testing.assert_array_equal(alone[0], velocities)
    np.testing.assert_array_equal(alone[1], impulses)
    assert velocities[2] == 1.5
