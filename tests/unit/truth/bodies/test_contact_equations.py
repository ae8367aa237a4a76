"""Equations of bodies that touch do not depend on the axes in which a scene is written."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.modes import Acting
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.truth_of_mechanism import truth_of

TURNS = Rotation.random(2, random_state=11)
WIDER = 3.0  # ratio of error bars: all are a few round-offs, of other numbers
ONE_TURN = pytest.mark.parametrize("number", [0, pytest.param(1, marks=pytest.mark.drill)])


def leaning_rod(lean: float, friction: float, turn: Rotation) -> Mechanism:
    """A rod that leans on one foot, in a plane; the whole world is turned."""
    up = (float(x) for x in turn.apply((0.0, 0.0, 1.0)))
    normal = tuple(up)
    x, y, z = turn.as_euler("xyz")
    plane = Joint(
        "plane", "planar", "world", "rod",
        orientation=(float(x), float(y), float(z)), axis=(0.0, 1.0, 0.0), second_axis=(1.0, 0.0, 0.0),
        q0=(0.0, -(0.5 * np.cos(lean) + 0.02), lean),
    )  # fmt: skip
    shapes = (
        Geometry("floor", "world", "plane", normal=normal),  # type: ignore[arg-type]
        Geometry("foot", "rod", "sphere", (0.0, 0.0, -0.5), radius=0.02),
    )
    rod = Body("rod", 1.0, inertia=(1 / 12,) * 3)
    gx, gy, gz = (float(-9.81 * x) for x in normal)
    pair = Pair("contact", ("foot", "floor"), friction=friction)
    return Mechanism((rod,), (plane,), gravity=(gx, gy, gz), geometries=shapes, pairs=(pair,))


@pytest.mark.one_in(3)
@pytest.mark.nightly_of("0.9-0.2-0.3-0")
@pytest.mark.drill
@ONE_TURN
@pytest.mark.parametrize(("lean", "friction", "until"), [(0.9, 0.2, 0.3), (0.1, 0.3, 0.9)])
def test_a_turned_planar_contact_keeps_its_motion_its_events_and_its_bars(
    lean: float, friction: float, until: float, number: int
) -> None:
    """A rod that slips at once, or later, moves alike in every turned world, known as well."""
    turn, times = TURNS[number], np.array([0.0, until])

    def motion(turn: Rotation) -> TwoRouteMotion:
        return truth_of(leaning_rod(lean, friction, turn), times)

    plain, turned = motion(Rotation.identity()), motion(turn)
    assert np.isinf(turned.horizon)
    assert [(event.kind, event.name) for event in turned.events] == [(event.kind, event.name) for event in plain.events]
    for one, other in zip(plain.events, turned.events, strict=True):
        assert one.time_low <= other.time_high
        assert other.time_low <= one.time_high
    for field in ("p_WB", "v_WB"):
        bars = plain.bars[field][-1], turned.bars[field][-1]
        one, other = (getattr(found.record, field)[-1, 0] for found in (plain, turned))
        assert np.abs(turn.as_matrix() @ one - other).max() <= sum(bars)
        assert max(bars) < WIDER * min(bars)


def test_a_state_that_violates_nothing_is_left_as_it_is() -> None:
    """What is exact to round-off stays to the last digit; a violation is removed, by both routes."""
    mechanism = leaning_rod(0.1, 0.3, Rotation.identity())
    dynamics, bodies = ContactDynamics(mechanism), ContactEquations(mechanism, MaximalCoordinates(mechanism).lean)
    stick = (Acting("stick"),)
    starts = np.concatenate(mechanism.start()), bodies.equations.equations.start()
    for equations, start in zip((dynamics, bodies), starts, strict=True):
        exact = equations.eliminated(np.append(start, 0.0), stick)
        assert equations.eliminated(exact, stick).tobytes() == exact.tobytes()
        moved = exact + 1e-7
        assert np.abs(equations.eliminated(moved, stick) - moved).max() > 1e-8
