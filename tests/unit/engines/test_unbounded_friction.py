"""A pair that never slips: engines with a cone take a large coefficient, projection takes none; others say why not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from balls_on_walls import on_plane

from proofroll.core.errors import InputError, NotUnique
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.coulomb import contact_forces
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.truth.bodies.body_impacts import impulse_of_a_contact


def test_a_pair_that_never_slips_starts_without_slip() -> None:
    """A start that slips is refused with its pair, its slip and what to do."""
    with pytest.raises(InputError, match=r"pairs\.contact\.friction = inf: they touch and slip at 1 m/s, which .* v0"):
        check_contacts(on_plane(slip=1.0))


@pytest.mark.drill
def test_an_impact_stops_all_slip() -> None:
    """A ball leaves an impact without slip, with its normal speed times its restitution."""
    fall, n = 9.81 * 0.96, np.array([0.28, 0.0, 0.96])
    hit = math.sqrt(2 * 0.05 / fall)
    found = truth(_scene(on_plane(slip=1.0, gap=0.05, restitution=0.5)), [0.0, 0.15])
    v, w = (found[name].to_numpy()[-1].ravel() for name in ("v_WB", "w_WB"))
    slip = v - np.cross(w, 0.1 * n) - (0.15 - hit) * np.array([0.0, 0.0, -9.81])
    assert slip == pytest.approx(0.5 * fall * hit * n, abs=1e-12)


def test_friction_without_bound_that_would_tear_is_not_unique() -> None:
    """A contact that only a pull could hold has no force, in forces and in impulses."""
    G, c = np.array([[1.0, -0.9, 0.0], [-0.9, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([-1.0, 2.0, 0.0])
    with pytest.raises(NotUnique, match="tip would not press but tear"):
        contact_forces(G, c, np.array([math.inf]), [None], ["tip"])
    assert impulse_of_a_contact(G, c, math.inf, 0.0) is None


def _scene(mechanism: Mechanism) -> Scene:
    return Scene("steep", "", (MechanismElement(mechanism),))
