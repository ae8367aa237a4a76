"""Records of both routes at a state: compiled modes and numbers state the same, and so do the routes."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check.law_states import by_the_bodies, by_the_tree
from proofroll.truth.switching.contact_taylor import CompiledStretch
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll_drill.law_faults import SCENES

DIGITS = 1e-11  # relative to the largest value of a record; 1e-13 is seen


@pytest.mark.drill_of("links")
@pytest.mark.parametrize("make", [SCENES[name][0] for name in ("slide", "rod", "links")], ids=["slide", "rod", "links"])
def test_compiled_records_are_those_in_numbers(make: object) -> None:
    """Poses, forces, places, normals, efforts and drives of both routes at the start."""
    mechanism: Mechanism = make()  # type: ignore[operator]
    dynamics, second = ContactDynamics(mechanism), MaximalCoordinates(mechanism)
    tree = ContactTree(dynamics, 1e-14, 1.0)
    bodies = ContactBodies(ContactEquations(mechanism, second.lean), 1e-14, 1.0)
    records = []
    for route in (tree, bodies):
        begun = route.begin()
        assert begun.mode is not None
        in_numbers = (
            by_the_tree(tree, begun.state, begun.mode)
            if route is tree
            else by_the_bodies(bodies, second, begun.state, begun.mode)
        )
        records.append(in_numbers)
        stretch = route.walk(0.0, begun.state, begun.mode, 1e-3)
        assert isinstance(stretch, CompiledStretch)
        assert stretch.by is not None
        record, pace = stretch.by.record_of(begun.mode, 0.0)(begun.state[:, None])
        assert pace > 0
        assert record[:, 0] == pytest.approx(in_numbers, abs=DIGITS * np.abs(in_numbers).max())
    assert records[0] == pytest.approx(records[1], abs=DIGITS * np.abs(records[0]).max())
