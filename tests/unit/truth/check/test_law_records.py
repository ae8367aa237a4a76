"""Records of both routes at a state: compiled modes and numbers state the same, and so do the routes."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.switching.contact_taylor import CompiledStretch
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll_drill.law_faults import SCENES

DIGITS = 1e-11  # relative to the largest value of a record; 1e-13 is seen


@pytest.mark.one_in(3)
@pytest.mark.drill_of("links")
@pytest.mark.parametrize("make", [SCENES[name][0] for name in ("slide", "rod", "links")], ids=["slide", "rod", "links"])
def test_compiled_records_are_those_in_numbers(make: object) -> None:
    """Poses, efforts and drives of both routes at the start, and the forces that their contacts bear."""
    mechanism: Mechanism = make()  # type: ignore[operator]
    dynamics, second = ContactDynamics(mechanism), MaximalCoordinates(mechanism)
    tree = ContactTree(dynamics, 1e-14, 1.0)
    bodies = ContactBodies(ContactEquations(mechanism, second.lean), 1e-14, 1.0)
    drives, records, borne = [number for number, _ in working(mechanism)], [], []
    for route in (tree, bodies):
        begun = route.begin()
        assert begun.mode is not None
        mode, state = begun.mode, begun.state
        p, v, _, w = route.bodies(state)
        stretch = route.walk(0.0, state, mode, 1e-3)
        assert isinstance(stretch, CompiledStretch)
        assert stretch.by is not None
        record, pace = stretch.by.record_of(mode, 0.0)(state[:, None])
        assert pace > 0
        moving = record[: 18 * len(p), 0].reshape(len(p), 18)
        for values, part in ((p, moving[:, :3]), (v, moving[:, 12:15]), (w, moving[:, 15:])):
            assert part == pytest.approx(values, abs=DIGITS)
        assert len(record) == 18 * len(p) + len(drives)
        named = dynamics.sample(*mechanism.start(), mode)[0]["named"]
        assert record[18 * len(p) :, 0] == pytest.approx(named[drives], abs=DIGITS * np.abs(named).max(initial=1.0))
        records.append(record[:, 0])
        borne.append(route.borne(state, mode)[1])
    assert records[0] == pytest.approx(records[1], abs=DIGITS * np.abs(records[0]).max())
    assert borne[0] == pytest.approx(borne[1], abs=DIGITS * np.abs(borne[0]).max())
