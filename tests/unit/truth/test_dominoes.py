"""Two boxes on hinges that fall towards each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.truth_of_mechanism import truth_of

_G, _MASS, _HIGH, _THICK, _APART, _SPIN = 9.81, 0.01, 0.048, 0.008, 0.02, 3.0
_ABOUT_CENTRE = _MASS * (_HIGH**2 + _THICK**2) / 12
_ABOUT_HINGE = _ABOUT_CENTRE + _MASS * (_HIGH**2 + _THICK**2) / 4


def _dominoes() -> Mechanism:
    """Two boxes, each hinged at its lower front edge; the first is pushed towards the second."""
    inertia = (_MASS * (0.024**2 + _HIGH**2) / 12, _ABOUT_CENTRE, _MASS * (0.024**2 + _THICK**2) / 12)
    edge = (_THICK / 2, 0.0, -_HIGH / 2)
    bodies = tuple(Body(f"d{k}", _MASS, inertia=inertia) for k in range(2))
    joints = tuple(
        Joint(
            f"j{k}", "revolute", "world", f"d{k}", (k * (_APART + _THICK) + _THICK / 2, 0, 0),
            child_position=edge, axis=(0, 1, 0), v0=(_SPIN * (k == 0),),
        )
        for k in range(2)
    )  # fmt: skip
    boxes = tuple(Geometry(f"g{k}", f"d{k}", "box", size=(_THICK, 0.024, _HIGH)) for k in range(2))
    pair = Pair("hit", ("g0", "g1"), friction=0.4)
    return Mechanism(bodies, joints, gravity=(0, 0, -_G), geometries=boxes, pairs=(pair,))


def test_boxes_apart_whose_edges_cross_as_lines_do_not_touch() -> None:
    """Edges of two boxes that cross beyond their ends are no contact, however fast they approach there."""
    check_contacts(_dominoes())


def _accelerated(_: float, y: np.ndarray) -> list[float]:
    """Rates of both angles and spins without contact."""
    rates = []
    for angle, spin in (y[:2], y[2:]):
        rates += [spin, _MASS * _G * (_HIGH / 2 * np.sin(angle) - _THICK / 2 * np.cos(angle)) / _ABOUT_HINGE]
    return rates


def _gap(_: float, y: np.ndarray) -> float:
    """Distance of the second box's upper corner from the face of the first."""
    (s0, c0), (s1, c1) = ((np.sin(angle), np.cos(angle)) for angle in (y[0], y[2]))
    x = _APART + _THICK - _THICK * c1 + _HIGH * s1
    z = _THICK * s1 + _HIGH * c1
    return float(c0 * x - s0 * z)


_gap.terminal = True  # type: ignore[attr-defined]  # as solve_ivp reads it


@pytest.mark.nightly
def test_a_pushed_box_meets_one_that_falls_back() -> None:
    """They meet when and as fast as two pendulums of an own integration do, and go on without approaching."""
    alone = solve_ivp(_accelerated, (0.0, 0.2), [0.0, _SPIN, 0.0, 0.0], events=_gap, rtol=1e-12, atol=1e-14)
    meeting, before = float(alone.t_events[0][0]), alone.y_events[0][0]
    times = np.array([0.0, meeting - 1e-6, meeting + 1e-6])
    found = truth_of(_dominoes(), times)
    assert found.ended == ""
    assert {event.kind for event in found.events} == {"impact"}
    assert [event.time for event in found.events] == pytest.approx([meeting] * len(found.events), abs=1e-10)
    assert found.record.v[1] == pytest.approx(before[[1, 3]], abs=1e-3)  # a microsecond earlier
    after = np.column_stack([found.record.q[-1], found.record.v[-1]]).ravel()
    closing = [_gap(0.0, after + change * np.array([after[1], 0, after[3], 0])) for change in (-1e-7, 1e-7)]
    assert closing[1] - closing[0] > -1e-12
