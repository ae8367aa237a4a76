"""Truths of mechanisms with actuators and couplings, against closed forms and another solver."""

from itertools import pairwise

import numpy as np
import pytest
from mechanism_scenes import true_motion
from scipy.integrate import solve_ivp

from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.reading.assembly import assemble
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.files.scene_file import load_scene
from proofroll.truth.truth_of_mechanism import truth_of

TIGHT = 1e-12  # of what two routes at 1e-14 leave, with room
ONES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))


def slider(actuator: Actuator | None = None, mass: float = 1.0, **more: object) -> Mechanism:
    """A mass on a slide without weight."""
    return Mechanism(
        (Body("b", mass, inertia=ONES),),
        (Joint("j", "prismatic", "world", "b", **more),),  # type: ignore[arg-type]
        actuators=(actuator,) if actuator else (),
        gravity=(0, 0, 0),
    )


@pytest.mark.drill
def test_a_limit_that_is_never_reached_changes_nothing() -> None:
    """A servo whose limit is larger than all its efforts has the truth of one without a limit."""
    one, two = true_motion("servo", [0.0, 0.5, 1.0]), true_motion("saturated_servo", [0.0, 0.5, 1.0], limit=150.0)
    assert two.events == ()
    assert np.abs(one.record.q - two.record.q).max() <= one.bars["q"][-1] + two.bars["q"][-1]


def test_one_effort_at_its_limit_all_the_time_is_clamped_beside_another_that_never_is() -> None:
    """Of two actuators with limits, one pushes with its limit from the start on, though nothing ever switches."""
    bodies = (Body("a", 1.0, inertia=ONES), Body("b", 1.0, inertia=ONES))
    joints = (Joint("one", "prismatic", "world", "a"), Joint("two", "prismatic", "world", "b"))
    actuators = (Actuator("m", "one", "torque", 5.0, limit=2.0), Actuator("n", "two", "torque", 1.0, limit=2.0))
    found = truth_of(Mechanism(bodies, joints, actuators=actuators, gravity=(0, 0, 0)), np.array([0.0, 1.0]))
    assert found.record.q[1] == pytest.approx([1.0, 0.5], abs=TIGHT)
    assert found.events == ()


@pytest.mark.nightly
def test_a_true_rotor_turns_with_the_rod_that_carries_it() -> None:
    """A rotor behind a gear n adds I [[1, n], [n, n^2]] to the mass matrix, and its mass; armature is n^2 I alone."""
    inertia, n, mass, g = 1e-4, 50.0, 0.1, 9.81
    a, b = 0.0, 0.7
    own = 1 / 12 + 1 / 4
    coupled = own + np.cos(b) / 2
    M = np.array([[2 * own + 1 + np.cos(b) + mass, coupled], [coupled, own]])
    weight = -g * np.array([(1.5 + mass) * np.sin(a) + np.sin(a + b) / 2, np.sin(a + b) / 2])
    effort = np.array([100 * (0.5 - a), 50 * (-1.0 - b)])
    rotor = inertia * np.array([[1, n], [n, n**2]])
    expected = np.linalg.solve(M + rotor, weight + effort)
    scene = load_scene("arm_rotor", elbow=b)
    found = JointCoordinates(scene.elements[0].mechanism)  # type: ignore[attr-defined]
    acceleration = found.solve(*found.mechanism.start()).acceleration
    assert acceleration == pytest.approx([*expected, n * expected[1]], rel=1e-12)
    armature = np.linalg.solve(M + np.diag([0, inertia * n**2]), weight + effort)
    assert np.abs(armature / expected - 1).max() > 1e-3
    truth = true_motion("arm_rotor", [0.0, 0.3, 1.0], elbow=b)
    assert truth.bars["q"][-1] < 1e-10


@pytest.mark.drill
def test_a_stiff_damper_lets_the_mass_go_its_time_constant() -> None:
    """A mass in a damper goes (F/c) t + (v0 - F/c) (m/c) (1 - exp(-c t/m)), and then as fast as its force."""
    t = np.array([0.0, 0.001, 0.2])
    found = true_motion("stiff_damper", t.tolist())
    assert found.record.q[:, 0] == pytest.approx(0.01 * t + 0.99e-3 * (1 - np.exp(-1000 * t)), abs=1e-15)
    assert found.bars["q"][-1] < TIGHT


@pytest.mark.drill
def test_friction_that_holds_a_weight_is_the_weight() -> None:
    """A mass that its friction can hold does not move, and friction tells the weight; a weaker one lets it fall."""
    found = true_motion("friction_hold", [0.0, 0.5, 1.0])
    assert np.abs(found.record.q).max() == np.abs(found.record.v).max() == 0.0
    assert found.record.named[:, 0] == pytest.approx([9.81] * 3, rel=1e-12)
    falls = true_motion("friction_hold", [0.0, 1.0], friction=4.81)
    assert falls.record.q[1, 0] == pytest.approx(-2.5, abs=TIGHT)
    assert falls.record.named[:, 0] == pytest.approx([4.81] * 2)


def test_a_velocity_servo_closes_in_on_its_speed() -> None:
    """With kv 5 and a target of 2 the place is 2 (t - (1 - exp(-5 t))/5)."""
    found = truth_of(slider(Actuator("a", "j", "velocity", 2.0, kd=5.0)), np.array([0.0, 0.7]))
    assert found.record.q[1, 0] == pytest.approx(2 * (0.7 - (1 - np.exp(-3.5)) / 5), abs=TIGHT)


def test_a_drive_of_time_is_integrated_as_such() -> None:
    """A force 3 sin 2t moves a mass by 3/2 t - 3/4 sin 2t."""
    found = truth_of(slider(torque=Formula("3*sin(2*t)")), np.array([0.0, 0.5, 2.0]))
    t = np.array([0.0, 0.5, 2.0])
    assert found.record.q[:, 0] == pytest.approx(1.5 * t - 0.75 * np.sin(2 * t), abs=TIGHT)


def test_breaks_of_a_table_cost_no_digits() -> None:
    """A force that is piecewise linear gives a path of cubics, joined at its breaks."""
    found = truth_of(slider(torque=Table((0.2, 0.5), (0.0, 3.0))), np.array([0.0, 0.2, 0.5, 1.0]))
    x, v = 10 * 0.3**3 / 6, 10 * 0.3**2 / 2
    assert found.record.q[:, 0] == pytest.approx([0.0, 0.0, x, x + v * 0.5 + 1.5 * 0.25], abs=TIGHT)
    assert found.events == ()
    assert found.bars["q"][-1] < TIGHT


@pytest.mark.drill
def test_a_coupled_joint_that_sticks_holds_the_other() -> None:
    """A wheel driven through a gear stays as long as the reflected friction of the other one is stronger."""
    wheels = (Body("a", 1.0, inertia=ONES), Body("b", 1.0, inertia=ONES))
    joints = (
        Joint("one", "revolute", "world", "a", torque=Formula("2*t")),
        Joint("two", "revolute", "world", "b", friction=0.5),
    )
    made = Mechanism(wheels, joints, couplings=(Coupling("g", "one", "two", -2.0),), gravity=(0, 0, 0))
    found = truth_of(made, np.array([0.0, 0.4, 1.0]))
    assert [(event.kind, event.name) for event in found.events] == [("slip", "two")]
    assert found.events[0].time == pytest.approx(0.5, abs=TIGHT)
    # (1 + 4) a = 2 t - 2 * 0.5 from then on
    assert found.record.q[:, 0] == pytest.approx([0.0, 0.0, 0.5**3 / 15], abs=TIGHT)
    assert found.record.named[1] == pytest.approx([-0.4, 0.4], abs=TIGHT)


def by_itself(mass: float, law: Actuator, spring: float, target: Formula, until: float) -> tuple[float, list[float]]:
    """Last place of a mass on a spring under a servo with a limit, and times at which the limit begins or ends."""
    n, bound = law.gear, law.bound

    def wanted(t: float, y: np.ndarray) -> float:
        return float(n * (law.kp * (target.at(t) - n * y[0]) - law.kd * n * y[1]))

    def rate(t: float, y: np.ndarray) -> list[float]:
        free = wanted(t, y)
        effort = free if mode == 0 else mode * bound
        return [y[1], (effort - spring * y[0]) / mass]

    def upper(t: float, y: np.ndarray) -> float:
        return wanted(t, y) - bound

    def lower(t: float, y: np.ndarray) -> float:
        return wanted(t, y) + bound

    y, t, times = np.zeros(2), 0.0, []
    first = wanted(0.0, y)
    mode = int(np.sign(first)) if abs(first) > bound else 0
    upper.terminal = lower.terminal = True  # type: ignore[attr-defined]
    while t < until:
        upper.direction, lower.direction = (-1.0, 1.0) if mode else (1.0, -1.0)  # type: ignore[attr-defined]
        events = [upper, lower] if mode == 0 else [upper if mode > 0 else lower]
        found = solve_ivp(rate, (t, until), y, "DOP853", events=events, rtol=1e-12, atol=1e-13)
        y, t = found.y[:, -1], float(found.t[-1])
        if found.status == 1:
            times.append(t)
            mode = 0 if mode else (1 if len(found.t_events[0]) else -1)
    return float(y[0]), times


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.drill) for seed in range(1, 4))])
def test_servos_with_limits_agree_with_another_solver(seed: int) -> None:
    """With random numbers and a target of time, place and switches are those of a plain solver with events."""
    random = np.random.default_rng(seed)
    mass, spring, kp = random.uniform(0.5, 2), random.uniform(0, 20), random.uniform(20, 80)
    gear = float(random.choice([-2.0, 0.5, 1.5]))
    target = Formula(f"{random.uniform(0.5, 1.5)}*cos({random.uniform(1, 6)}*t) + 0.3*t")
    actuator = Actuator("a", "j", "position", target, kp, random.uniform(0, 4), gear, random.uniform(3, 12))
    place, times = by_itself(mass, actuator, spring, target, 1.5)
    found = truth_of(slider(actuator, mass, stiffness=spring), np.array([0.0, 1.5]))
    assert len(times) > 1
    assert all(b - a > 1e-6 for a, b in pairwise(times))
    assert [event.time for event in found.events] == pytest.approx(times, abs=1e-8)
    assert found.record.q[1, 0] == pytest.approx(place, abs=1e-8)
    assert found.bars["q"][-1] < 1e-10


@pytest.mark.nightly
def test_a_drive_that_leads_to_a_dead_centre_before_the_first_sample_ends_there() -> None:
    """A rod between two slides, one driven, is stretched at 0.2 s: the truth ends there, and knows what was before."""
    bodies = tuple(Body(name, 1.0, inertia=ONES) for name in "ab")
    joints = (
        Joint("driven", "prismatic", "world", "a", axis=(1, 0, 0), motion=Formula("0.8 + t")),  # type: ignore[arg-type]
        Joint("led", "prismatic", "world", "b", q0=(0.6,), dependent=True),  # type: ignore[arg-type]
    )
    rod = Loop("rod", "distance", "a", "b", length=1.0)  # type: ignore[arg-type]
    found = truth_of(assemble(Mechanism(bodies, joints, (rod,))), np.array([0.0, 1.0]))
    assert "singular" in found.ended or "singular" in found.reason
    assert found.record.time.tolist() == [0.0]
    assert found.works == pytest.approx(0.0, abs=1e-15)
    assert found.bars["work"] < 1e-12
