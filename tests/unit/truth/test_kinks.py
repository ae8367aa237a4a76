"""Laws with abs, sign, max and min: their kinks end stretches, so that both routes keep their order."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.kinks import held_sides
from proofroll.elements.mechanism.scene.parts import Force, Spring
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.files.scene_file import load_scene
from proofroll.truth.switching import contact_taylor
from proofroll.truth.switching.kink_sides import sides_ahead
from proofroll.truth.truth_of_mechanism import truth_of


def slider(law="", at=0.0, v0=1.0, mass=1.0, **more):
    """Body on a slide at 1 m + q from the end of a spring with this law."""
    joint = Joint("x", "prismatic", "world", "m", axis=(1, 0, 0), q0=(at,), v0=(v0,), **more.pop("joint", {}))
    springs = (Spring("s", "world", "m", position_a=(-1, 0, 0), force=SpringLaw(law)),) if law else ()
    return Mechanism((Body("m", mass),), (joint,), springs=springs, gravity=(0, 0, 0), **more)


@pytest.mark.nightly_of("False")
@pytest.mark.nightly
@pytest.mark.parametrize("compiled", [True, pytest.param(False, marks=pytest.mark.drill)])
def test_a_spring_with_two_stiffnesses_swings_through_its_kink(compiled, monkeypatch):
    """K = 4 N/m for pull and 1 N/m for push: half swings of pi/2 s and pi s, whatever integrates them."""
    if compiled:
        pytest.importorskip("heyoka")
    else:
        monkeypatch.setattr(contact_taylor, "heyoka", None)
    found = truth_of(slider("max(4*(L - 1), L - 1)"), np.pi * np.array([0.0, 0.5, 1.5, 2.0]))
    assert found.record.q[:, 0] == pytest.approx([0, 0, 0, 0], abs=1e-12)
    assert found.record.v[:, 0] == pytest.approx([1, -1, 1, -1], abs=1e-12)
    assert (found.bars["p_WB"][-1], found.horizon) == (pytest.approx(0.0, abs=1e-11), np.inf)
    assert not found.events


@pytest.mark.nightly
def test_laws_with_one_meaning_give_one_motion():
    """abs, max, min and sign write one law in four ways."""
    laws = ("2.5*(L-1) + 1.5*abs(L-1)", "max(4*(L-1), L-1)", "-min(-4*(L-1), 1-L)", "(2.5 + 1.5*sign(L-1))*(L-1)")
    places = [truth_of(slider(law), np.array([0.0, 3.0])).record.q[-1, 0] for law in laws]
    assert places == pytest.approx([places[0]] * 4, abs=1e-13)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("at", "v0"), [(0.0, 0.0), (0.0, 1e-8), (1e-13, -1.0), (-1e-13, 1.0)])
def test_a_start_at_a_kink_takes_the_side_of_its_motion(at, v0):
    """At rest on the kink the load decides, at a speed the speed, whatever the last digits of the place are."""
    push = Force("push", "m", "force", (-1.0, 0.0, 0.0))
    found = truth_of(slider("max(4*(L - 1), L - 1)", at, v0, forces=(push,)), np.array([0.0, 0.5]))
    k = 4.0 if v0 == 1.0 else 1.0
    w = np.sqrt(k)
    true = (at + 1 / k) * np.cos(0.5 * w) + v0 / w * np.sin(0.5 * w) - 1 / k
    assert found.record.q[-1, 0] == pytest.approx(true, abs=1e-12)


@pytest.mark.one_in(3)
@pytest.mark.daily("force-max(0, sin(3*t))", "torque-abs(cos(3*t))", "target-sign(sin(3*t))", "force-min(t, 1 - t)")
@pytest.mark.parametrize("text", ["max(0, sin(3*t))", "abs(cos(3*t))", "sign(sin(3*t))", "min(t, 1 - t)"])
@pytest.mark.drill
@pytest.mark.parametrize("part", ["force", "torque", "target"])
def test_kinks_of_drives_are_located(text, part):
    """The velocity of a free body is the integral of its drive, to round-off."""
    signal = Formula(text)
    parts = {
        "force": {"forces": (Force("f", "m", "force", (signal, 0.0, 0.0)),)},
        "torque": {"joint": {"torque": signal}},
        "target": {"actuators": (Actuator("a", "x", "torque", signal),)},
    }
    found = truth_of(slider(v0=0.0, **parts[part]), np.array([0.0, 2.0]))
    w = np.pi / 6
    kinks = {"max": [2 * w], "abs": [w, 3 * w], "sign": [2 * w], "min": [0.5]}[text.split("(")[0]]
    x, weights = np.polynomial.legendre.leggauss(40)
    pieces = [((b + a) / 2, (b - a) / 2) for a, b in pairwise([0.0, *kinks, 2.0])]
    true = sum(half * weights @ signal.at(middle + half * x) for middle, half in pieces)
    assert found.record.v[-1, 0] == pytest.approx(true, abs=1e-12)


@pytest.mark.nightly
def test_a_motion_with_a_kink_in_its_acceleration_is_followed():
    """A slide that is moved by max(0, t - 0.5)^3 begins without a jolt; its drive is mass times acceleration."""
    found = truth_of(
        slider(v0=0.0, mass=2.0, joint={"motion": Formula("max(0, t - 0.5)^3")}), np.array([0.0, 0.4, 1.0])
    )
    assert found.record.q[:, 0] == pytest.approx([0, 0, 0.125], abs=1e-13)
    assert found.record.named[:, 0] == pytest.approx([0, 0, 6.0], abs=1e-11)


@pytest.mark.drill
def test_a_motion_whose_speed_jumps_ends_the_truth():
    """No finite force moves a slide by abs(t - 0.5): the truth ends there, with what is before."""
    found = truth_of(slider(v0=-1.0, at=0.5, joint={"motion": Formula("abs(t - 0.5)")}), np.array([0.0, 0.4, 1.0]))
    assert found.end == pytest.approx(0.5, abs=1e-12)
    assert "x.motion" in found.ended
    assert found.record.time.tolist() == [0.0, 0.4]


@pytest.mark.drill
def test_a_law_that_would_hold_ends_the_truth():
    """A damper of constant force sticks at rest, which no formula says: the truth ends there, with the reason."""
    found = truth_of(slider("2*sign(dL)", v0=1.0), np.array([0.0, 0.4, 1.0]))
    assert found.end == pytest.approx(0.5, abs=1e-9)
    assert "dry friction" in found.ended
    assert found.record.q[1, 0] == pytest.approx(0.4 - 0.16, abs=1e-13)


def test_powers_have_derivatives_where_their_base_is_zero():
    """A cubic spring that starts without load has a truth by Taylor series."""
    pytest.importorskip("heyoka")
    found = truth_of(slider("4000*(L - 1)^3", v0=1.0), np.array([0.0, 0.1]))
    true = solve_ivp(lambda _, y: [y[1], -4000 * y[0] ** 3], (0, 0.1), [0, 1], rtol=1e-13, atol=1e-15).y[0, -1]
    assert found.record.q[-1, 0] == pytest.approx(true, abs=1e-11)
    assert "maximal coordinates, Taylor series in long doubles" in found.routes


def test_the_way_from_a_kink_is_that_of_the_first_power_above_round_off():
    """An argument that grows as t^4 has its side, and a constant zero has one, too."""
    rates = lambda y, _: np.array([y[1], y[2], y[3], 24.0, 1.0])  # noqa: E731
    start = np.zeros(5)
    assert sides_ahead(start, lambda y: np.array([-y[0], 1.0 + y[0] - 1.0, 0.0]), rates) == (-1, 1, 1)


def test_a_held_side_goes_on_beyond_the_kink():
    """Rates with a held side are smooth through the kink."""
    equations = JointCoordinates(slider("3*abs(L - 1)"))
    equations.functions = held_sides(equations.mechanism.kinks, (1,), equations.functions)
    values = [float(equations.solve(np.array([q]), np.zeros(1)).acceleration[0]) for q in (-0.1, 0.1)]
    assert values == pytest.approx([0.3, -0.3])


def test_unknown_functions_are_refused_with_the_known_ones():
    """The advice names functions with kinks, too."""
    with pytest.raises(InputError, match="abs, sign, max, min"):
        SpringLaw("sinh(L)")


@pytest.mark.nightly
def test_a_prescribed_motion_starts_on_the_side_to_which_time_goes():
    """From a kink at time 0 a motion |sin 3t| has the rate 3, up to the next kink, at which the truth ends."""
    joint = Joint("x", "prismatic", "world", "m", axis=(1, 0, 0), motion=Formula("0.1*abs(sin(3*t))"))
    found = truth_of(Mechanism((Body("m", 2.0),), (joint,)), np.array([0.0, 0.5, 1.0, 1.2]))
    assert found.record.v[0] == pytest.approx(0.3, abs=1e-14)
    assert found.record.q[:, 0] == pytest.approx(0.1 * np.sin(3 * np.array([0.0, 0.5, 1.0])), abs=1e-13)
    assert found.end == pytest.approx(np.pi / 3, rel=1e-9)
    assert "jumps in its rate" in found.ended


STEPS = (
    Table((0.0, 0.3), (0.0, 2.0), hold=True),
    Table((0.0, 0.3, 0.30001), (1.0, 1.0, 2.0)),
    Formula("sign(t - 0.3)"),
    Formula("max(t - 0.3, 0)"),
)
DRIVES = {
    "load of a joint": lambda step: slider(joint={"torque": step}),
    "target": lambda step: slider(actuators=(Actuator("a", "x", "position", step, kp=4.0, kd=0.1),)),
    "force": lambda step: slider(forces=(Force("push", "m", "force", (step, 0.0, 0.0)),)),
}


@pytest.mark.parametrize(
    "drive", ["load of a joint", *(pytest.param(name, marks=pytest.mark.nightly) for name in ("target", "force"))]
)
@pytest.mark.parametrize("step", STEPS, ids=["held", "ramp", "sign", "max"])
def test_a_truth_tells_when_its_drives_jump(drive, step):
    """Where a load or a target has a step or a corner the truth has a border, and nowhere else."""
    element = MechanismElement(DRIVES[drive](step))
    found = truth(Scene("stepped", "", (element,)), np.linspace(0.0, 0.5, 6))
    corners = [0.3, 0.30001] if isinstance(step, Table) and not step.hold else [0.3]
    assert found.attrs["borders"] == pytest.approx(corners, abs=1e-12)


@pytest.mark.nightly
def test_borders_of_all_elements_are_told():
    """The truth of a loaded slide beside a ball that comes to roll has the borders of both."""
    slide = MechanismElement(slider(joint={"torque": Table((0.0, 0.1), (0.0, 2.0), hold=True)}))
    ball = load_scene("slide_to_roll")
    both, alone = (
        truth(Scene("both", "", elements), np.linspace(0.0, 0.4, 5)).attrs["borders"].tolist()
        for elements in ((slide, *ball.elements), ball.elements)
    )
    assert alone != []
    assert both == [0.1, *alone]
