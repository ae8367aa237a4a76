"""Dry friction and stops of joints in Exudyn's redundant coordinates, by its own law along a coordinate."""

from dataclasses import replace

import mechanism_runs as runs
import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism

pytest.importorskip("exudyn")

CUBE = Body("mass", 2.0, inertia=(0.1, 0.1, 0.1))
G = 9.81


def slider(cube=CUBE, **law):
    """A cube on a vertical guide."""
    return Mechanism((cube,), (Joint("guide", "prismatic", "world", "mass", **law),))


def test_a_mass_rests_on_its_stop():
    """It gives way by what its weight presses a spring together that stops it within a step, and carries the weight."""
    run = runs.build("redundant", slider(q0=(0.1,), limits=(0.0, 1.0)), dt=1e-3)
    run.advance(1.0)
    sample = run.sample()
    assert sample.p_WB[0, 2] == pytest.approx(-G * 1e-6, rel=1e-3)
    assert sample.stop == pytest.approx([2 * G], rel=1e-4)
    np.testing.assert_allclose(sample.joint_force[0], [0, 0, 2 * G], atol=1e-3)


def test_a_ton_rests_on_its_stop():
    """Newton's method ends where round-off of the forces on a heavy mass is larger than it is for 1 kg."""
    ton = Body("mass", 1000.0, inertia=(50.0, 50.0, 50.0))
    matched = load_engine("exudyn").presets["redundant"]["matched"]
    run = load_engine("exudyn").build(slider(ton, q0=(1.0,), limits=(0.0, 2.0)), matched)
    run.advance(1.0)
    assert run.sample().stop == pytest.approx([1000 * G], rel=1e-4)


def test_a_stop_holds_what_its_joint_carries():
    """A light hub with a heavy rod on it falls onto the stop of its hinge and rests there, within the stop's give."""
    hub, rod = Body("hub", 0.1, inertia=(1e-4, 1e-4, 1e-4)), Body("rod", 10.0, com=(1.0, 0, 0), inertia=(0.1, 1.0, 1.0))
    hinge = Joint("hinge", "revolute", "world", "hub", axis=(0, -1, 0), limits=(-0.5, 1.0))
    mechanism = Mechanism((hub, rod), (hinge, Joint("weld", "fixed", "hub", "rod")))
    run = runs.build("redundant", mechanism, dt=1e-3)
    run.advance(1.5)
    sample = run.sample()
    moment = 10.0 * G * np.cos(0.5)
    assert sample.stop[0] == pytest.approx(moment, rel=1e-3)
    assert 2 * np.arcsin(sample.q_WB[0, 2]) == pytest.approx(0.5, abs=2 * moment * 1e-6 / 11.0 + 1e-5)


@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_friction_acts_against_the_motion_from_the_first_step(speed):
    """Forward or backward, the mass loses speed at the rate F/m, which is linear in time and so exact."""
    guide = Joint("guide", "prismatic", "world", "mass", v0=(speed,), friction=4.0)
    run = runs.build("redundant", Mechanism((CUBE,), (guide,), gravity=(0.0, 0.0, 0.0)), dt=1e-3)
    run.advance(0.1)
    assert run.sample().v_WB[0, 2] == pytest.approx(speed - np.sign(speed) * 0.2, abs=1e-12)


def test_friction_slows_a_mass_and_holds_it():
    """The mass loses its speed at the rate F/m, and then stands."""
    mechanism = Mechanism(
        (CUBE,), (Joint("guide", "prismatic", "world", "mass", v0=(1.0,), friction=8.0),), gravity=(0.0, 0.0, 0.0)
    )
    run = runs.build("redundant", mechanism, dt=1e-3)
    run.advance(0.1)
    assert run.sample().v_WB[0, 2] == pytest.approx(1 - 4 * 0.1, abs=0.02)
    assert run.sample().friction == pytest.approx([-8.0], rel=1e-6)
    run.advance(1.0)
    assert run.sample().p_WB[0, 2] == pytest.approx(0.125, abs=2e-3)
    assert abs(run.sample().v_WB[0, 2]) < 1e-6


@pytest.mark.one_in(3)
@pytest.mark.parametrize("dt", [1e-3, 1e-4, 1e-5])
def test_a_wheel_that_nothing_else_drives_comes_to_rest(dt):
    """At any step Newton's method ends where bristles make forces of the round-off of the wheel's angle."""
    wheel = Body("wheel", 1.0, inertia=(2e-3, 2e-3, 2e-3))
    axle = Joint("axle", "revolute", "world", "wheel", v0=(2.0,), friction=0.1, damping=0.5)
    matched = load_engine("exudyn").presets["redundant"]["matched"]
    mechanism = Mechanism((wheel,), (axle,), gravity=(0.0, 0.0, 0.0))
    run = load_engine("exudyn").build(mechanism, replace(matched, dt=dt))
    run.advance(0.03)
    assert abs(run.sample().w_WB[0, 2]) < 1e-6


def test_a_hinge_rubs_beyond_a_turn():
    """A wheel on an axle loses its spin at the rate M/I, also where its angle has passed a whole turn."""
    wheel = Body("wheel", 1.0, inertia=(0.1, 0.1, 0.2))
    axle = Joint("axle", "revolute", "world", "wheel", v0=(5.0,), friction=0.2)
    run = runs.build("redundant", Mechanism((wheel,), (axle,), gravity=(0.0, 0.0, 0.0)), dt=1e-3)
    run.advance(2.0)
    assert run.sample().w_WB[0, 2] == pytest.approx(3.0, abs=0.02)
    assert run.sample().joint_torque[0, 2] == pytest.approx(-0.2, rel=1e-6)


def test_each_force_is_that_of_its_joint():
    """Beside a joint without a law, friction is reported at the joint that rubs, and a stop's force at its joint."""
    names = ("free", "rubs", "rests")
    joints = (
        Joint("free", "prismatic", "world", "free", v0=(1.0,)),
        Joint("rubs", "prismatic", "world", "rubs", v0=(2.0,), friction=8.0),
        Joint("rests", "prismatic", "world", "rests", q0=(0.1,), limits=(0.0, 1.0)),
    )
    run = runs.build("redundant", Mechanism(tuple(Body(name, 2.0, inertia=CUBE.inertia) for name in names), joints))
    run.advance(1.0)
    sample = run.sample()
    assert sample.friction[1:] == pytest.approx([8.0, 0.0], rel=1e-6)
    assert sample.stop[1:] == pytest.approx([0.0, 2 * G], rel=1e-4)
    assert np.isnan([sample.friction[0], sample.stop[0]]).all()


def test_rebounds_are_refused():
    """A stop with restitution is refused with the reason."""
    with pytest.raises(Refused, match="springs with dampers"):
        runs.build("redundant", slider(q0=(0.1,), limits=(0.0, 1.0), restitution=0.5))
