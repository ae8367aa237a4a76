"""Forces that several distributions of a load allow, wherever they reach."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.truth_of_mechanism import truth_of


def _skid_steered() -> Mechanism:
    """A chassis on four driven wheels, left ones backward, that turns on the spot."""
    bodies, joints = (
        [Body("chassis", 10.0, inertia=(0.2, 0.3, 0.4))],
        [Joint("float", "free", "world", "chassis", q0=(0.0, 0.0, 0.06, 1.0, 0.0, 0.0, 0.0))],
    )
    shapes, pairs = [Geometry("floor", "world", "plane")], list[Pair]()
    for name, x, y in (("fl", 0.15, 0.13), ("fr", 0.15, -0.13), ("rl", -0.15, 0.13), ("rr", -0.15, -0.13)):
        bodies.append(Body(name, 0.2, inertia=(3e-4, 5e-4, 3e-4)))
        motion = Formula(f"{-5 if y > 0 else 5}*t")
        joints.append(Joint(f"a{name}", "revolute", "chassis", name, (x, y, 0.0), axis=(0.0, 1.0, 0.0), motion=motion))
        shapes.append(Geometry(f"g{name}", name, "sphere", radius=0.06))
        pairs.append(Pair(f"p{name}", (f"g{name}", "floor"), friction=0.6))
    return Mechanism(
        tuple(bodies), tuple(joints), gravity=(0.0, 0.0, -9.81), geometries=tuple(shapes), pairs=tuple(pairs)
    )


@pytest.mark.nightly
def test_forces_of_joints_and_drives_that_hang_on_a_split_are_not_given() -> None:
    """Four wheels share the load: axles, drives and their work have no values, the free joint has, bars stay small."""
    found = truth_of(_skid_steered(), np.array([0.0, 0.01]))
    wrench, drives = found.record.wrench, found.record.named
    assert np.isnan(drives).all()
    assert np.isnan(wrench[:, 1:, 2]).all()
    assert np.isfinite(wrench[:, 0]).all()
    assert found.works is not None
    assert np.isnan(found.works[1]).all()
    assert max(float(found.bars[name][-1]) for name in ("wrench", "named", "work", "p_WB", "v_WB")) < 1e-9


@pytest.mark.nightly
def test_a_light_body_on_a_heavy_one_slides_until_both_move_alike() -> None:
    """A box of 2 kg on a belt of 1e6 kg sticks where momentum says, as on a light belt."""
    belt, box, speed, mu, g = 1e6, 2.0, 0.8, 0.3, 9.81
    bodies = Body("belt", belt), Body("box", box, inertia=(0.02,) * 3)
    joints = (
        Joint("run", "prismatic", "world", "belt", axis=(1.0, 0.0, 0.0), v0=(speed,)),
        Joint("float", "free", "world", "box", q0=(0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0)),
    )
    feet = [
        Geometry(f"foot{k}", "box", "sphere", (x, y, -0.1), radius=0.0)
        for k, (x, y) in enumerate([(0.15, 0.15), (0.15, -0.15), (-0.15, 0.15), (-0.15, -0.15)])
    ]
    pairs = tuple(Pair(f"touch{k}", (f"foot{k}", "top"), friction=mu) for k in range(4))
    shapes = (Geometry("top", "belt", "plane"), *feet)
    mechanism = Mechanism(bodies, joints, gravity=(0.0, 0.0, -g), geometries=shapes, pairs=pairs)
    found = truth_of(mechanism, np.array([0.0, 0.4]))
    sticks = speed / (mu * g * (1 + box / belt))
    common = speed * belt / (belt + box)
    assert found.ended == ""
    assert all(event.time_low <= sticks <= event.time_high for event in found.events)
    assert found.record.p_WB[1, 1, 0] == pytest.approx(mu * g * sticks**2 / 2 + common * (0.4 - sticks), abs=1e-9)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("lean", "bend", "holds"),
    [(0.02, 1.8, (0.52, 2.85)), pytest.param(0.5, -0.88, (1.51, 2.94), marks=pytest.mark.drill)],
)
def test_a_leg_that_rubs_in_its_joints_rests_on_its_tip(lean: float, bend: float, holds: tuple[float, float]) -> None:
    """Dry friction and the floor hold a leg of two links together: it rests where any distribution of that holds."""
    links = tuple(Body(name, 1.0, com=(0.0, 0.0, -0.5), inertia=(0.1, 0.1, 0.01)) for name in ("upper", "lower"))
    axis, low = (0.0, -1.0, 0.0), -np.cos(lean) - np.cos(lean + bend)
    joints = (
        Joint("shoulder", "revolute", "world", "upper", axis=axis, q0=(lean,), friction=holds[0]),
        Joint("elbow", "revolute", "upper", "lower", (0.0, 0.0, -1.0), axis=axis, q0=(bend,), friction=holds[1]),
    )
    shapes = (
        Geometry("floor", "world", "plane", position=(0.0, 0.0, float(low))),
        Geometry("tip", "lower", "sphere", position=(0.0, 0.0, -1.0), radius=0.0),
    )
    pairs = (Pair("touch", ("tip", "floor"), friction=0.1),)
    leg = Mechanism(links, joints, gravity=(0.0, 0.0, -9.81), geometries=shapes, pairs=pairs)
    found = truth_of(leg, np.array([0.0, 0.1]))
    assert "2 of 2 samples" in MechanismTruth.truth(MechanismElement(leg), np.array([0.0, 0.1]), ()).attrs["laws"]
    assert not found.ended
    assert found.record.v[-1] == pytest.approx([0.0, 0.0], abs=0.0)
    assert np.isnan(found.record.named).all()


@pytest.mark.drill
@pytest.mark.nightly_of("100000000.0")
@pytest.mark.parametrize("ratio", [1e6, pytest.param(1e8, marks=pytest.mark.drill)])
def test_a_box_rests_on_one_that_is_far_lighter(ratio: float) -> None:
    """Forces that cancel on a light body leave few digits of its own: both boxes rest, whatever the ratio of masses."""
    bodies, joints, shapes = [], [], [Geometry("floor", "world", "plane")]
    for name, mass, height in (("light", 1.0, 0.1), ("heavy", ratio, 0.3)):
        bodies.append(Body(name, mass, inertia=(mass * 0.04 / 6,) * 3))
        joints.append(Joint(f"f{name}", "free", "world", name, q0=(0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0)))
        shapes.append(Geometry(f"{name}_box", name, "box", size=(0.2, 0.2, 0.2)))
    pairs = (Pair("ground", ("light_box", "floor"), 0.5), Pair("stack", ("heavy_box", "light_box"), 0.5))
    stack = Mechanism(tuple(bodies), tuple(joints), gravity=(0.0, 0.0, -9.81), geometries=tuple(shapes), pairs=pairs)
    found = truth_of(stack, np.array([0.0, 0.1]))
    assert "2 of 2 samples" in MechanismTruth.truth(MechanismElement(stack), np.array([0.0, 0.1]), ()).attrs["laws"]
    assert found.record.p_WB[-1] == pytest.approx(np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.3]]), abs=1e-14)
    assert found.bars["p_WB"][-1] < 1e-14
