"""Dry friction and stops of joints in the projection method, against closed forms."""

from dataclasses import replace

import mechanism_runs as runs
import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism

CUBE = Body("mass", 1.0, inertia=(0.1, 0.1, 0.1))
G = 9.81


def slider(**law):
    """A mass of 1 kg on a vertical guide."""
    return Mechanism((CUBE,), (Joint("guide", "prismatic", "world", "mass", **law),))


def place(run):
    """Height of the mass."""
    return float(run.sample().p_WB[0, 2])


@pytest.mark.parametrize(
    ("options", "tolerance"),
    [({}, 1e-10), pytest.param({"integrator": "rk4", "dt": 1e-3}, 1e-7, marks=pytest.mark.drill)],
)
def test_a_mass_on_a_spring_rubs_to_rest_off_the_middle(options, tolerance):
    """Half swings lose 2F/k each, and the seventeenth ends where the spring is weaker than friction."""
    if options:
        options |= {"rtol": 2.220446049250313e-14}
    run = runs.build("dependent", runs.model("spring_friction"), **options)
    run.advance(3.0)
    assert run.sample().p_WB[0, 0] == pytest.approx(0.0363281234516611, abs=tolerance)
    run.advance(5.5)
    assert run.sample().p_WB[0, 0] == pytest.approx(0.02, abs=tolerance)
    assert not run.sample().v_WB[0, 0] > tolerance
    kinds = [event.kind for event in run.events()]
    assert kinds == ["turn"] * 16 + ["stick"]
    assert run.events()[-1].time == pytest.approx(1.7 * np.pi, abs=tolerance)


def test_a_pendulum_rubs_to_rest():
    """It stops where and when an energy balance and a quadrature say, as its turns do."""
    run = runs.build("dependent", runs.model("pendulum_friction"))
    run.advance(7.2)
    turn, *_, last = run.events()
    assert turn.time == pytest.approx(1.04080620663580, abs=1e-10)
    assert last.time == pytest.approx(7.09217092106288, abs=1e-9)
    axis = run.sample().q_WB[0]
    assert 2 * np.arctan2(axis[1:].sum(), axis[0]) == pytest.approx(-0.0290843317121, abs=1e-9)


def test_friction_holds_what_is_lighter_and_carries_its_weight():
    """A mass that friction can hold does not creep, and the joint transmits its weight."""
    run = runs.build("dependent", slider(friction=15.0))
    run.advance(1.0)
    assert place(run) == 0.0
    np.testing.assert_allclose(run.sample().joint_force[0], [0, 0, G], atol=1e-12)
    heavy = runs.build("dependent", slider(friction=5.0))
    heavy.advance(0.5)
    assert place(heavy) == pytest.approx(-0.5 * (G - 5) * 0.25, abs=1e-12)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_mass_falls_on_a_stop(restitution):
    """It rests there at once, or rebounds by parabolas, the next of which is the square of the restitution as high."""
    run = runs.build("dependent", slider(q0=(1.0,), limits=(0.0, 2.0), restitution=restitution))
    fall = np.sqrt(2 / G)
    run.advance(float(fall * (1 + restitution)))
    assert place(run) == pytest.approx(restitution**2, abs=1e-10)
    run.advance(2.0)  # rebounds end at 3 falls
    assert place(run) == pytest.approx(0.0, abs=1e-10)
    np.testing.assert_allclose(run.sample().joint_force[0], [0, 0, G], atol=1e-9)
    assert run.events()[0].time == pytest.approx(fall, abs=1e-11)


def test_a_joint_that_is_held_feels_the_others():
    """The first of two rods is held while the second swings, until what that asks of its friction is too much."""
    rod = {"mass": 1.0, "com": (0.0, -0.5, 0.0), "inertia": (1 / 12, 0.001, 1 / 12)}
    joints = (
        Joint("upper", "revolute", "world", "a", friction=6.0),
        Joint("lower", "revolute", "a", "b", (0.0, -1.0, 0.0), q0=(2.0,)),
    )
    mechanism = Mechanism((Body("a", **rod), Body("b", **rod)), joints, gravity=(0.0, -G, 0.0))
    run = runs.build("dependent", mechanism, rtol=1e-10)
    fixed = replace(mechanism, joints=(Joint("upper", "fixed", "world", "a"), joints[1]))
    truth = runs.build("dependent", fixed)
    slip = None
    for t in np.arange(1, 100) * 0.01:
        run.advance(float(t))
        if run.events():
            slip = run.events()[0]
            break
        truth.advance(float(t))
        np.testing.assert_allclose(run.sample().p_WB, truth.sample().p_WB, atol=1e-8)
        assert abs(run.sample().joint_torque[0, 2]) <= 6.0 + 1e-9
    assert slip is not None
    assert slip.kind == "slip"
    assert slip.name == "upper"
    truth.advance(slip.time)
    assert abs(truth.sample().joint_torque[0, 2]) == pytest.approx(6.0, abs=1e-7)


def test_loops_with_friction_are_refused():
    """Dry friction in a mechanism with loops is refused with the reason."""
    mechanism = runs.model("slider_crank")
    rubbing = replace(mechanism, joints=(replace(mechanism.joints[0], friction=1.0), *mechanism.joints[1:]))
    with pytest.raises(Refused, match="this mechanism has loops"):
        runs.build("dependent", rubbing)
