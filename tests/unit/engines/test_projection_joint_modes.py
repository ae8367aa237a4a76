"""Laws that switch, and couplings, in the projection method: against closed forms and the truth."""

from dataclasses import replace

import mechanism_runs as runs
import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.published import true_values

CUBE = Body("mass", 1.0, inertia=(0.1, 0.1, 0.1))
G = 9.81


def slider(**law):
    """A mass of 1 kg on a vertical guide."""
    return Mechanism((CUBE,), (Joint("guide", "prismatic", "world", "mass", **law),))


def place(run):
    """Height of the mass."""
    return float(run.sample().p_WB[0, 2])


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("options", "tolerance"),
    [({}, 1e-10), pytest.param({"integrator": "rk4", "dt": 1e-3}, 1e-7, marks=pytest.mark.nightly)],
)
def test_a_mass_on_a_spring_rubs_to_rest_off_the_middle(options, tolerance):
    """Half swings lose 2F/k each, and the seventeenth ends where the spring is weaker than friction."""
    if options:
        options |= {"rtol": 2.220446049250313e-14}
    run = runs.build("dependent", runs.model("spring_friction"), **options)
    (true,) = true_values("spring_friction")
    run.advance(true["at"])
    assert run.sample().p_WB[0, 0] == pytest.approx(true["values"]["q.slide"], abs=tolerance)
    run.advance(5.5)
    assert run.sample().p_WB[0, 0] == pytest.approx(0.02, abs=tolerance)
    assert not run.sample().v_WB[0, 0] > tolerance
    kinds = [event.kind for event in run.events()]
    assert kinds == ["turn"] * 16 + ["stick"]
    assert run.events()[-1].time == pytest.approx(1.7 * np.pi, abs=tolerance)


@pytest.mark.drill
def test_a_pendulum_rubs_to_rest():
    """It stops where and when an energy balance and a quadrature say, as its turns do."""
    run = runs.build("dependent", runs.model("pendulum_friction"))
    run.advance(7.2)
    (true,) = true_values("pendulum_friction")
    turn, *_, last = run.events()
    assert turn.time == pytest.approx(true["events"][0], abs=1e-10)
    assert last.time == pytest.approx(true["rests"], abs=1e-9)
    axis = run.sample().q_WB[0]
    assert 2 * np.arctan2(axis[1:].sum(), axis[0]) == pytest.approx(true["values"]["q.pivot"], abs=1e-9)


@pytest.mark.drill
def test_a_mass_that_hardly_falls_comes_to_rest():
    """Rebounds from the height of a file's last digits are summed, as are the last ones of any fall."""
    run = runs.build("dependent", slider(q0=(1e-12,), limits=(0.0, 2.0), restitution=0.5))
    run.advance(0.1)
    assert [event.kind for event in run.events()] == ["impact", "impact"]


@pytest.mark.drill
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


@pytest.mark.drill
def test_friction_in_a_loop_is_a_drive_against_the_motion():
    """A crank drive whose shaft rubs moves as one whose shaft is driven backwards, until it turns."""
    made = runs.model("slider_crank")
    rubbing, driven = (
        replace(made, joints=(replace(made.joints[0], **law), *made.joints[1:]))
        for law in ({"friction": 0.3}, {"torque": -0.3})
    )
    one, two = runs.build("dependent", rubbing, rtol=1e-10), runs.build("dependent", driven, rtol=1e-10)
    one.advance(0.1)
    two.advance(0.1)
    np.testing.assert_allclose(one.sample().v_WB, two.sample().v_WB, atol=1e-10)


@pytest.mark.nightly
def test_a_loop_with_friction_turns_when_it_should():
    """A crank drive whose shaft rubs has the true motion, through the turn of its friction."""
    made = runs.model("slider_crank")
    rubbing = replace(made, joints=(replace(made.joints[0], friction=0.3), *made.joints[1:]))
    times = np.array([0.0, 0.4, 0.8])
    run, truth = runs.build("dependent", rubbing), truth_of(rubbing, times).record
    for k, t in enumerate(times[1:], 1):
        run.advance(float(t))
        np.testing.assert_allclose(run.sample().p_WB, truth.p_WB[k], atol=1e-10)
    (turn,) = run.events()
    assert (turn.kind, turn.name) == ("turn", "shaft")


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("options", "tolerance"), [({}, 1e-12), ({"integrator": "rk4", "dt": 4e-3}, 1e-7)])
def test_an_effort_meets_its_limit_when_it_should(options, tolerance):
    """The clamp of a servo is a switch: its times are exact to the order of the method, and so is what follows."""
    options |= {"rtol": 2.220446049250313e-14} if options else {}
    run = runs.build("dependent", runs.model("saturated_servo"), **options)
    (true,) = true_values("saturated_servo")
    run.advance(true["at"])
    assert [event.kind for event in run.events()] == ["release", "saturate"] * 2
    # Of rk4 it is the error of its step, 1.9e-8 s with every kind of arithmetic that was tried.
    np.testing.assert_allclose([event.time for event in run.events()], true["events"], atol=tolerance)
    place, speed, _ = true["values"].values()
    assert run.sample().p_WB[0, 0] == pytest.approx(place, abs=tolerance)
    assert run.sample().v_WB[0, 0] == pytest.approx(speed, abs=20 * tolerance)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("target", [Formula("2*sin(9*t)"), Table((0.0, 0.15, 0.3), (0.0, 2.0, -2.0))])
def test_friction_a_stop_a_limit_and_a_target_in_time_switch_together(target):
    """A servo with a limit pushes a mass that rubs onto its stop and off it: the motion and the forces are true."""
    servo = Actuator("servo", "guide", "position", target, kp=200.0, kd=5.0, limit=60.0)
    made = replace(slider(friction=2.0, limits=(-0.05, 0.1)), actuators=(servo,))
    times = np.array([0.0, 0.11, 0.23, 0.4])
    run, truth = runs.build("dependent", made), truth_of(made, times)
    for k, t in enumerate(times[1:], 1):
        run.advance(float(t))
        assert place(run) == pytest.approx(truth.record.p_WB[k, 0, 2], abs=1e-10)
        assert run.sample().effort[0] == pytest.approx(truth.record.named[k, 0], abs=1e-8)
    assert [(event.kind, event.name) for event in run.events()] == [(e.kind, e.name) for e in truth.events]


@pytest.mark.nightly
def test_a_rack_and_pinion_on_a_spring():
    """A coupling of a hinge and a slide is one row more: ratio, force and motion are those of one oscillator."""
    joints = (
        Joint("pinion", "revolute", "world", "wheel", stiffness=5.0, v0=(0.2,)),
        Joint("slide", "prismatic", "world", "rack", q0=(0.05,), v0=(0.1,)),
    )
    bodies = (Body("wheel", 1.0, inertia=(0.1, 0.1, 0.1)), Body("rack", 2.0, inertia=(0.1, 0.1, 0.1)))
    made = Mechanism(bodies, joints, gravity=(0, 0, 0), couplings=(Coupling("teeth", "pinion", "slide", 0.5, 0.05),))
    run, rate = runs.build("dependent", made), np.sqrt(5.0 / (0.1 + 0.5**2 * 2.0))
    run.advance(4.0)
    angle = 0.2 / rate * np.sin(rate * 4.0)
    assert run.sample().p_WB[1, 2] == pytest.approx(0.05 + 0.5 * angle, abs=1e-10)
    assert run.sample().coupling[0] == pytest.approx(-2.0 * 0.5 * rate**2 * angle, abs=1e-9)
    built = run.built()
    assert (built.rows, built.rank, built.mobility) == (11, 11, 1)


@pytest.mark.drill
def test_a_coupling_and_a_stop_hold_together():
    """Of two geared wheels one meets its stop: both stop, and the gear carries what drives the other."""
    made = runs.model("gear_pair")
    stopped = replace(made, joints=(made.joints[0], replace(made.joints[1], limits=(-0.5, 1.0))))
    run = runs.build("dependent", stopped)
    run.advance(1.0)
    (hit,) = run.events()
    assert (hit.kind, hit.name) == ("impact", "axle2")
    assert hit.time == pytest.approx(np.sqrt(0.4), abs=1e-10)
    assert run.sample().coupling[0] == pytest.approx(-2.0, abs=1e-10)
    assert run.sample().stop[1] == pytest.approx(2.0, abs=1e-10)


def test_what_holds_one_freedom_twice_is_refused():
    """Two stops of geared wheels at once leave open which of them carries: the reason says so."""
    made = runs.model("gear_pair")
    both = replace(made, joints=(replace(made.joints[0], friction=3.0), replace(made.joints[1], friction=3.0)))
    with pytest.raises(Refused, match="not determinate"):
        runs.build("dependent", both)
