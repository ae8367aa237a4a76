"""Cylinders that land and stand on an end: as boxes on their corners, while the end stays flat and does not spin."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.switching.standing_ends import standing_ends
from proofroll.truth.truth_of_mechanism import truth_of

MASS, RADIUS, LENGTH, GRAVITY = 1.357, 0.06, 0.12, 9.81
DIGITS = 1e-11  # 1e-13 is seen


def can(height: float = LENGTH / 2, v0: Any = (0, 0, 0, 0, 0, 0), slope: float = 0.0, **law: float) -> Mechanism:
    """A can above a table that may slope down towards (0.8, 0.6)."""
    across, along = MASS * (3 * RADIUS**2 + LENGTH**2) / 12, MASS * RADIUS**2 / 2
    shapes = (
        Geometry("table", "world", "plane"),
        Geometry("wall", "can", "cylinder", radius=RADIUS, length=LENGTH),
    )
    down = GRAVITY * np.array([0.8 * np.sin(slope), 0.6 * np.sin(slope), -np.cos(slope)])
    x, y, z = down.tolist()
    return Mechanism(
        (Body("can", MASS, inertia=(across, across, along)),),
        (Joint("float", "free", "world", "can", q0=(0, 0, height, 1, 0, 0, 0), v0=v0),),
        gravity=(x, y, z),
        geometries=shapes,
        pairs=(Pair("land", ("wall", "table"), **({"friction": 1.0} | law)),),
    )


def test_a_can_stands_where_it_is_put() -> None:
    """Nothing moves; the lower end bears the weight, the upper one nothing."""
    found = truth_of(can(), np.array([0.0, 0.6]))
    assert (found.ended, found.horizon, found.events) == ("", np.inf, ())
    assert found.record.p_WB[1, 0].tolist() == [0, 0, LENGTH / 2]
    assert found.pressed is not None
    assert found.pressed[1, :, :6] == pytest.approx(np.array([[0, 0, MASS * GRAVITY, 0, 0, 0], [0] * 6]), abs=DIGITS)
    assert found.bars["pressed"][1] < DIGITS


@pytest.mark.drill
def test_a_can_that_falls_on_its_end_stays() -> None:
    """One impact of the end, by the name that its contact has."""
    found = truth_of(can(0.36), np.array([0.0, 0.2, 0.6]))
    assert (found.ended, found.horizon) == ("", np.inf)
    ((kind, name, time),) = [(event.kind, event.name, event.time) for event in found.events]
    assert (kind, name, time) == ("impact", "land.1", pytest.approx(np.sqrt(0.6 / GRAVITY), abs=DIGITS))
    assert len(found.bounces) == 1
    assert found.record.p_WB[2, 0] == pytest.approx([0, 0, LENGTH / 2], abs=DIGITS)
    assert found.pressed is not None
    assert found.pressed[2, 0, 2] == pytest.approx(13.31217, abs=DIGITS)


@pytest.mark.drill
def test_a_can_on_a_slope_stands_up_to_the_slope_at_which_its_weight_leaves_the_end() -> None:
    """That is radius over half the length, whatever the direction of the slope."""
    limit = float(np.arctan(2 * RADIUS / LENGTH))
    found = truth_of(can(slope=limit - 1e-3, friction=1.2), np.array([0.0, 0.5]))
    assert found.record.p_WB[1, 0].tolist() == [0, 0, LENGTH / 2]
    with pytest.raises(NotUnique, match="does not stand on its whole end from t = 0 s on"):
        truth_of(can(slope=limit + 1e-3, friction=1.2), np.array([0.0, 0.5]))


@pytest.mark.nightly
def test_a_can_slides_down_a_slope_on_its_end_as_a_point_does() -> None:
    """Friction in one direction is μ times the load, wherever the load acts."""
    slope, mu = 0.4, 0.2
    found = truth_of(can(slope=slope, friction=mu), np.array([0.0, 0.5]))
    way = GRAVITY * (np.sin(slope) - mu * np.cos(slope)) * 0.5**2 / 2
    assert found.record.p_WB[1, 0] == pytest.approx([0.8 * way, 0.6 * way, LENGTH / 2], abs=DIGITS)


@pytest.mark.nightly
def test_a_can_that_lands_on_a_cart_moves_on_with_it() -> None:
    """Momentum along the rail is shared: the end sticks on a plate that moves."""
    still = can(0.11)
    cart = Joint("rail", "prismatic", "world", "cart", axis=(1, 0, 0), v0=(0.4,))
    moving = replace(
        still,
        bodies=(*still.bodies, Body("cart", 5.0, inertia=(1.0, 1.0, 1.0))),
        joints=(*still.joints, cart),
        geometries=(replace(still.geometries[0], body="cart"), still.geometries[1]),
    )
    found = truth_of(moving, np.array([0.0, 0.05, 0.4]))
    assert (found.ended, found.horizon) == ("", np.inf)
    assert found.record.v_WB[2, :, 0] == pytest.approx(0.4 * 5.0 / (5.0 + MASS), abs=DIGITS)


@pytest.mark.parametrize(("height", "time"), [(LENGTH / 2, "0 s"), (0.36, r"0\.24731 s")])
def test_a_can_that_spins_on_its_end_with_friction_has_no_determinate_motion(height: float, time: str) -> None:
    """Friction against spin depends on how the load is spread over the end; it does not at the corners of a square."""
    spins = can(height, v0=(0, 0, 0, 0, 0, 3.0))
    try:
        ended = truth_of(spins, np.array([0.0, 0.2, 0.3])).ended
    except NotUnique as refused:
        ended = str(refused)
    assert re.search(f"spins on its end at t = {time}", ended)


def test_cylinders_that_tilt_keep_their_rims() -> None:
    """Corners stand for ends only that start parallel to the plane and do not turn away from it."""
    assert standing_ends(can(0.36, v0=(0, 0, 0, 1, 0, 0))) is None
    assert standing_ends(can(0.36, v0=(1, 0, 0, 0, 0, 5))) is not None
