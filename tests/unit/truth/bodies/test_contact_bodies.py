"""Which contacts stay closed where several share a load: corners of a box that slides on one face."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.truth_of_mechanism import truth_of

G, NARROW = 9.81, 1e-11  # m: bars of 1e-13 are seen
INERTIA = (1 / 600,) * 3


def box_on(gravity: tuple[float, float, float], joint: Joint, friction: float) -> Mechanism:
    """A cube of 0.1 m on a plane, by eight corners."""
    corners = [(x, y, z) for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.05, 0.05)]
    feet = [Geometry(f"corner{k}", "box", "sphere", place, radius=0.0) for k, place in enumerate(corners)]
    pairs = tuple(Pair(f"touch{k}", (f"corner{k}", "plane"), friction=friction) for k in range(8))
    shapes = (Geometry("plane", "world", "plane"), *feet)
    return Mechanism((Body("box", 1.0, inertia=INERTIA),), (joint,), gravity=gravity, geometries=shapes, pairs=pairs)


@pytest.mark.nightly_of("False")
@pytest.mark.drill
@pytest.mark.parametrize("planar", [pytest.param(False, marks=pytest.mark.drill), True])
def test_a_box_that_begins_to_slide_on_four_corners_is_well_posed(planar: bool) -> None:
    """Its motion has a truth to the end, also where two corners lie behind one another; loads of corners have none."""
    tilt, mu = np.pi / 6, 0.3
    joint = Joint("free", "free", "world", "box", q0=(0, 0, 0.05, 1, 0, 0, 0))
    if planar:
        axes = {"axis": (0.0, 1.0, 0.0), "second_axis": (1.0, 0.0, 0.0)}
        joint = Joint("plane", "planar", "world", "box", q0=(0, -0.05, 0), **axes)  # type: ignore[arg-type]
    box = box_on((G * np.sin(tilt), 0.0, -G * np.cos(tilt)), joint, mu)
    found = truth_of(box, np.array([0.0, 0.5]))
    assert np.isinf(found.horizon)
    assert found.bars["p_WB"][-1] < NARROW
    pull = G * (np.sin(tilt) - mu * np.cos(tilt))
    assert found.record.p_WB[1, 0] == pytest.approx([pull * 0.5**2 / 2, 0.0, 0.05], abs=NARROW)
    assert found.pressed is not None
    assert np.isnan(found.pressed[:, ::2, 2]).all()


@pytest.mark.nightly
@pytest.mark.parametrize("pull", [150.0, pytest.param(200.0, marks=pytest.mark.nightly)])
def test_a_block_slides_on_a_block_that_is_pulled_away(pull: float) -> None:
    """Friction drives the upper block by mu g however its corners share its weight, at any pull that tears it off."""
    mu, heavy, light = 0.9, 10.0, 1.0
    rail = Joint("rail", "prismatic", "world", "lower", axis=(1, 0, 0), torque=pull)
    free = Joint("free", "free", "world", "box", q0=(0, 0, 0.05, 1, 0, 0, 0))
    box = box_on((0.0, 0.0, -G), free, mu)
    shapes = (Geometry("plane", "lower", "plane"), *box.geometries[1:])
    lower = Body("lower", heavy, inertia=(0.1, 0.1, 0.1))
    pulled = Mechanism((lower, *box.bodies), (rail, free), gravity=box.gravity, geometries=shapes, pairs=box.pairs)
    found = truth_of(pulled, np.array([0.0, 0.5]))
    assert np.isinf(found.horizon)
    way = 0.5**2 / 2 * np.array([(pull - mu * light * G) / heavy, mu * G])
    assert found.record.p_WB[1, :, 0] == pytest.approx(way, abs=NARROW)
    assert found.bars["p_WB"][-1] < NARROW
