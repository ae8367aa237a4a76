"""Terms of a mechanism that the ladder of models can leave out."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mechanism_scenes import mechanism_named

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.optional_terms import optional_terms

JOINTS, CONTACTS = "dry friction of joints", "friction of contacts"


@pytest.mark.parametrize(
    ("parameters", "taken"),
    [
        ({"friction": 0.3, "rail_friction": 2.0}, {CONTACTS: {"friction": 0.0}}),
        ({"friction": 2.0, "sole_friction": 0.3}, {JOINTS: {"friction": 0.0}, CONTACTS: {"sole_friction": 0.0}}),
    ],
)
def test_a_parameter_belongs_to_the_law_that_has_its_value(
    parameters: dict[str, float], taken: dict[str, dict[str, float]]
) -> None:
    """Where joints and contacts rub, a parameter is left out of those alone which have its number."""
    flick = mechanism_named("flick")
    assert isinstance(flick, Mechanism)
    knuckle, *others = flick.joints
    pairs = tuple(replace(pair, friction=0.3) for pair in flick.pairs)
    mechanism = replace(flick, joints=(replace(knuckle, friction=2.0), *others), pairs=pairs)
    found = {term.name: dict(term.taken) for term in optional_terms(mechanism, parameters)}
    assert {name: found[name] for name in (JOINTS, CONTACTS) if name in found} == taken
