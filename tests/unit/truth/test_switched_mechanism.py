"""Truths of mechanisms whose joints have dry friction or stops, against closed forms."""

import re
from dataclasses import replace

import numpy as np
import pytest
from mechanism_scenes import mechanism_named, true_motion

from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.scene.drives import Coupling
from proofroll.files.scene_file import load_scene
from proofroll.truth import followed_paths
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.followed_paths import CLOSE, TOLERANCES
from proofroll.truth.natural_units import natural_units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, first_close, follow
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.published import true_values

TIGHT = 1e-11  # of what two routes at 1e-14 leave after some ten switches, with room


def test_a_stop_that_is_not_reached_may_have_a_restitution() -> None:
    """A mass that falls and never comes to its stop falls as one without: its restitution is not asked for."""
    joint = Joint("slide", "prismatic", "world", "b", axis=(0, 0, 1), limits=(-9.0, 9.0), restitution=0.5)
    found = truth_of(Mechanism((Body("b", 1.0),), (joint,), gravity=(0, 0, -10.0)), np.array([0.0, 1.0]))
    assert found.record.q[-1] == pytest.approx([-5.0], abs=TIGHT)
    assert found.events == ()


@pytest.mark.drill
def test_a_spring_that_rubs_loses_four_parts_of_friction_a_swing() -> None:
    """Half swings last pi sqrt(m/k), end at (-1)^n (1 - 0.06 n), and the mass rests where the spring is too weak."""
    found = true_motion("spring_friction", [0.0, 1.0, 2.0], start=0.3)
    half = np.pi / 10
    assert [event.kind for event in found.events] == ["turn"] * 4 + ["stick"]
    for number, event in enumerate(found.events, 1):
        assert event.time == pytest.approx(number * half, abs=TIGHT)
        assert event.time_low <= number * half <= event.time_high
        assert event.name == "slide"
    swings = int(1.0 // half)
    middle, reach = 0.03 * (-1) ** swings, 0.3 - 0.03 - 0.06 * swings
    expected = middle + (-1) ** swings * reach * np.cos(10 * (1.0 - swings * half))
    assert found.record.q[1, 0] == pytest.approx(expected, abs=TIGHT)
    assert abs(found.record.q[1, 0] - expected) <= found.bars["q"][1]
    assert found.record.q[2, 0] == pytest.approx(0.0, abs=TIGHT)


@pytest.mark.drill
def test_a_hinge_that_rubs_turns_seven_times_and_rests() -> None:
    """All turns and the place of rest are those of the balance of energy."""
    (true,) = true_values("pendulum_friction")
    events = true_motion("pendulum_friction", [0.0, true["at"]]).events
    assert [event.kind for event in events] == ["turn"] * 7 + ["stick"]
    times = [event.time for event in events]
    found = true_motion("pendulum_friction", [0.0, *times])
    assert times[-1] == pytest.approx(true["rests"], abs=TIGHT)
    assert found.record.q[1:, 0] == pytest.approx([*true["turns"], true["values"]["q.pivot"]], abs=1e-12)


@pytest.mark.drill
def test_an_impact_that_presses_two_stops_has_no_unique_outcome() -> None:
    """A block that rebounds from the end of a box and pushes it against its own stop leaves more than one motion."""
    joints = (
        Joint("box", "prismatic", "world", "box", axis=(1, 0, 0), limits=(0.0, 1.0)),
        Joint("slot", "prismatic", "box", "block", (0.1, 0, 0), axis=(1, 0, 0), limits=(-0.1, 1.0), v0=(-1.0,),
              restitution=0.5),
    )  # fmt: skip
    bodies = tuple(Body(name, 1.0, inertia=(1.0, 1.0, 1.0)) for name in ("box", "block"))
    found = truth_of(Mechanism(bodies, joints, gravity=(0.0, 0.0, 0.0)), np.array([0.0, 0.05, 0.3]))
    assert re.search(r"presses box and slot at once: impacts in turn and at once differ by 0\.33", found.ended)
    assert found.end == pytest.approx(0.1, abs=TIGHT)
    assert found.record.q[:, 1] == pytest.approx([0.0, -0.05], abs=TIGHT)


@pytest.mark.nightly
def test_impacts_of_two_masses_that_accumulate_are_summed() -> None:
    """Two masses that fall on a stop and on each other hit without end in finite time, and then rest."""
    joints = (
        Joint("lower", "prismatic", "world", "a", q0=(0.3,), limits=(0.0, 10.0), restitution=0.2),
        Joint("upper", "prismatic", "a", "b", q0=(0.3,), limits=(0.0, 10.0), restitution=0.2),
    )
    bodies = tuple(Body(name, 1.0, inertia=(0.1, 0.1, 0.1)) for name in ("a", "b"))
    found = truth_of(Mechanism(bodies, joints), np.array([0.0, 0.1, 3.0]))
    assert (found.ended, found.horizon) == ("", np.inf)
    assert {(event.kind, event.name) for event in found.events[-2:]} == {("settle", "lower"), ("settle", "upper")}
    assert np.abs(found.record.q[-1]).max() <= found.bars["q"][-1]
    assert np.abs(found.record.v[-1]).max() <= found.bars["v"][-1]


def test_rebounds_are_summed_by_the_fastest_impact() -> None:
    """An impact settles against the fastest one at its stop, which need not be the first."""
    mechanism = mechanism_named("stop")
    tree = ContactTree(ContactDynamics(mechanism), 1e-14, 1.0)
    assert [tree._settles(0, speed, 0.5) for speed in (1.0, 100.0, 1e-4)] == [False, False, True]


@pytest.mark.drill
def test_rebounds_come_to_rest_after_infinitely_many() -> None:
    """With e = 0.5 the impacts end after three times the time of the fall, which the last event tells."""
    fall = np.sqrt(2 / 9.81)
    found = true_motion("stop", [0.0, 1.2, 2.0], restitution=0.5)
    assert found.events[0].time == pytest.approx(fall, abs=TIGHT)
    assert found.events[1].time == pytest.approx(2 * fall, abs=TIGHT)
    assert found.events[-1].kind == "settle"
    assert found.events[-1].time == pytest.approx(3 * fall, abs=1e-9)
    assert found.record.q[-1, 0] == 0.0
    after = 1.2 - 2 * fall - fall / 2  # since the third impact: the flights last 1, 1/2, 1/4 of the fall
    assert found.record.q[1, 0] == pytest.approx(9.81 * fall / 8 * after - 9.81 * after**2 / 2, abs=1e-10)


@pytest.mark.nightly
def test_rebounds_on_a_guide_that_rubs_come_to_rest_too() -> None:
    """Friction makes each fall slower than its rise; both routes follow turns that lie 1e-12 m above the stop."""
    e, friction = 0.4, 1.0
    stop = mechanism_named("stop", restitution=e)
    found = truth_of(replace(stop, joints=(replace(stop.joints[0], friction=friction),)), np.array([0.0, 0.5, 1.5]))
    rise, fall = 9.81 + friction, 9.81 - friction
    slower, speed = np.sqrt(fall / rise), np.sqrt(2 * fall)
    rests = speed / fall + e * speed * (1 / rise + slower / fall) / (1 - e * slower)
    assert np.isinf(found.horizon)
    assert found.events[-1].kind == "settle"
    assert found.events[-1].time == pytest.approx(rests, abs=TIGHT)
    assert found.record.q[-1, 0] == 0.0


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("0.7-0.1-6")
@pytest.mark.arithmetic
@pytest.mark.parametrize(("restitution", "impacts"), [(0.1, 6), (0.01, 3), (0.001, 2)])
@pytest.mark.parametrize("height", [pytest.param(0.3, marks=pytest.mark.drill), 0.7])
def test_which_rebound_is_the_last_hangs_on_no_digit(restitution: float, impacts: int, height: float) -> None:
    """A restitution of which a power is 1e-6 leaves as many rebounds at any height, and both routes agree on them."""
    box = Body("box", 1.0, inertia=(0.01, 0.02, 0.02))
    rail = {"axis": (0.0, 0.0, 1.0), "limits": (0.0, 10.0), "restitution": restitution}
    found = truth_of(
        Mechanism((box,), (Joint("rail", "prismatic", "world", "box", q0=(height,), **rail),)), np.array([0.0, 1.0])
    )
    assert np.isinf(found.horizon)
    assert [event.kind for event in found.events] == ["impact"] * impacts + ["settle"]


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("height", "restitution"), [(0.0, 1.0), (1e-9, 0.5)])
def test_what_lies_on_a_stop_or_nearly_so_comes_to_rest(height: float, restitution: float) -> None:
    """Rebounds that are round-off do not go on for ever, and nothing is dropped on the stop that it lies on."""
    stop = mechanism_named("stop", restitution=restitution)
    joint = replace(stop.joints[0], q0=(height,))
    found = truth_of(replace(stop, joints=(joint,)), np.array([0.0, 0.01]))
    assert abs(found.record.q[-1, 0]) <= found.bars["q"][-1]
    ends = [event for event in found.events if event.kind == "settle"]
    assert len(ends) == bool(height)
    assert all(event.time_low <= 3 * np.sqrt(2 * height / 9.81) <= event.time_high for event in ends)


@pytest.mark.one_in(3)
@pytest.mark.arithmetic
@pytest.mark.parametrize(
    ("part", "known"), [(-1e-6, True), (-1e-11, False), (0.0, False), (1e-11, False), (1e-6, True)]
)
def test_a_throw_that_rubs_and_ends_at_its_stop_is_ill_posed(part: float, known: bool) -> None:
    """A throw that ends at its stop hits it or turns by the last digits: known until then, by both routes alike."""
    slows = 9.81 + 2.0
    throw = float(np.sqrt(2 * slows * 0.2)) * (1 + part)
    rail = {"axis": (0.0, 0.0, 1.0), "limits": (-5.0, 0.2), "restitution": 0.5, "friction": 2.0}
    box = Body("box", 1.0, inertia=(1.0, 1.0, 1.0))
    found = truth_of(
        Mechanism((box,), (Joint("rail", "prismatic", "world", "box", v0=(throw,), **rail),)), np.array([0.0, 0.1, 0.3])
    )
    assert found.record.q[1, 0] == pytest.approx(0.1 * throw - slows * 0.1**2 / 2, abs=1e-13)
    if known:
        assert np.isinf(found.horizon)
        assert ("impact" in [event.kind for event in found.events]) == (part > 0)
    else:  # speed after time in which it is lost, less that of the excess over the stop
        assert found.horizon == pytest.approx(throw / slows, abs=1e-5)
        assert found.events == ()
        assert "hold or hit a stop" in found.reason


@pytest.mark.drill
def test_a_joint_that_comes_back_to_the_stop_of_its_start_grazes_it() -> None:
    """A pendulum released at its stop returns to it at rest: places known to 1e-12 leave an impact of 1e-6 possible."""
    free = mechanism_named("pendulum", angle=0.5)
    stopped = replace(free, joints=(replace(free.joints[0], limits=(-0.6, 0.5)),))
    found, back = truth_of(stopped, np.array([0.0, 1.0, 2.5])), truth_of(free, np.array([0.0, 1.0]))
    assert found.events == ()
    assert found.horizon == pytest.approx(1.66, abs=0.1)
    assert found.record.q[1] == pytest.approx(back.record.q[1], abs=TIGHT)


def test_a_joint_that_starts_beyond_its_stop_by_rounding_leaves_it_without_an_impact() -> None:
    """A pendulum released a billionth of its range beyond a stop falls as one without stops."""
    free = mechanism_named("pendulum", angle=2.8)
    beyond = replace(free, joints=(replace(free.joints[0], limits=(-1.2, 2.8 - 3.9e-9)),))
    found, fell = (truth_of(each, np.array([0.0, 0.5])) for each in (beyond, free))
    assert (found.events, found.horizon) == ((), np.inf)
    assert found.record.q[1] == pytest.approx(fell.record.q[1], abs=TIGHT)


def test_friction_that_holds_does_not_creep() -> None:
    """A mass that its friction can hold stays, and friction carries the load."""
    held = Mechanism(
        (Body("b", 1.0, inertia=((1, 0, 0), (0, 1, 0), (0, 0, 1))),),
        (Joint("j", "prismatic", "world", "b", friction=15.0),),
    )
    found = truth_of(held, np.array([0.0, 0.5, 1.0]))
    assert found.record.q[:, 0].tolist() == found.record.v[:, 0].tolist() == [0.0, 0.0, 0.0]
    assert found.record.wrench[2, 0, 2] == pytest.approx(9.81, rel=1e-12)
    assert found.events == ()


@pytest.mark.drill
def test_two_joints_that_feel_each_other_stick_and_slip_alike_in_both_routes() -> None:
    """A double pendulum with friction in both hinges has the same modes by sweeps and by trial."""
    inertia = ((1 / 12, 0, 0), (0, 1e-3, 0), (0, 0, 1 / 12))
    rods = (Body("a", 1.0, (0, -0.5, 0), inertia), Body("b", 1.0, (0, -0.5, 0), inertia))
    joints = (
        Joint("upper", "revolute", "world", "a", q0=(1.2,), friction=1.5),
        Joint("lower", "revolute", "a", "b", position=(0, -1, 0), q0=(-0.4,), friction=1.0, limits=(-0.9, 0.3)),
    )
    found = truth_of(Mechanism(rods, joints, gravity=(0, -9.81, 0)), np.linspace(0, 1.5, 4))
    assert np.isinf(found.horizon)
    happened = [("stick", "lower"), ("slip", "lower"), ("turn", "upper"), ("stick", "lower")]
    assert [(event.kind, event.name) for event in found.events] == happened
    assert found.bars["q"][-1] < 1e-9


@pytest.mark.drill
def test_a_stop_that_is_never_reached_changes_nothing() -> None:
    """A pendulum between stops that it does not reach has the truth of one without."""
    free = mechanism_named("pendulum", angle=0.5)
    from dataclasses import replace

    held = replace(free, joints=(replace(free.joints[0], limits=(-0.6, 0.6)),))
    times = np.array([0.0, 0.7, 1.4])
    one, two = truth_of(free, times), truth_of(held, times)
    assert two.events == ()
    assert np.abs(one.record.q - two.record.q).max() <= one.bars["q"][-1] + two.bars["q"][-1]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"limits": (1.0, 2.0)}, "joints.j.q0 = 0.0: the joint starts beyond a stop; its limits are 1 and 2"),
        ({"limits": (0.0, 1e-6), "q0": (-5e-10,)}, "joints.j.q0 = -5e-10: the joint starts beyond a stop"),
        ({"limits": (1.0, -1.0)}, "joints.j.limits"),
        ({"limits": (-1.0, 1.0), "restitution": 1.5}, "joints.j.restitution = 1.5: no impact returns more"),
        ({"restitution": 0.5}, "joints.j.restitution = 0.5: there is no stop without limits"),
        ({"friction": -1.0}, "joints.j.friction = -1.0: must be at least 0"),
    ],
)
def test_bad_laws_are_one_line(more: dict[str, object], said: str) -> None:
    """Each impossible stop or friction names its field and what to do."""
    with pytest.raises(InputError) as raised:
        Joint("j", "prismatic", "world", "b", **more)  # type: ignore[arg-type]
    assert said in str(raised.value)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.arithmetic
@pytest.mark.parametrize("ratio", [-0.7, 1.3])
def test_joints_that_share_one_freedom_turn_together(ratio: float) -> None:
    """A mass thrown upwards and one that it draws along, both rubbing, turn at once: parabolas before and after."""
    lift = Joint("lift", "prismatic", "world", "a", axis=(0, 0, 1), v0=(2.0,), friction=1.3)
    rail = Joint("rail", "prismatic", "world", "b", axis=(1, 0, 0), v0=(2.0 * ratio,), friction=0.9)
    drawn = Mechanism(
        tuple(Body(name, mass, inertia=(1.0, 1.0, 1.0)) for name, mass in (("a", 1.5), ("b", 0.8))),
        (lift, rail),
        couplings=(Coupling("belt", "lift", "rail", ratio),),
        gravity=(0.0, 0.0, -9.81),
    )
    inertia, rubbing = 1.5 + ratio**2 * 0.8, 1.3 + 0.9 * abs(ratio)
    slows, falls = ((1.5 * 9.81 + side * rubbing) / inertia for side in (1, -1))
    turns = 2.0 / slows
    found = truth_of(drawn, np.array([0.0, turns + 0.2]))
    assert [(event.kind, event.name) for event in found.events] == [("turn", "lift"), ("turn", "rail")]
    assert [event.time for event in found.events] == pytest.approx([turns] * 2, abs=TIGHT)
    height = turns - falls * 0.2**2 / 2
    assert found.record.q[1] == pytest.approx([height, ratio * height], abs=TIGHT)
    assert np.isinf(found.horizon)


@pytest.mark.one_in(3)
@pytest.mark.arithmetic
@pytest.mark.parametrize(
    ("scene", "parameters", "edge"),
    [
        pytest.param("pendulum_friction", {"angle": 2.0}, 9.81 * 0.5 * np.sin(2.0), marks=pytest.mark.drill),
        ("spring_friction", {}, 100.0),
        ("friction_hold", {}, 9.81),
    ],
)
def test_friction_that_just_holds_is_ill_posed(scene: str, parameters: dict[str, float], edge: float) -> None:
    """Within round-off of what dry friction has to hold, which events come hangs on nothing, on both sides alike.

    With 1e-12 more friction it holds and nothing happens; with as much less it slips and turns, however little the
    spring then creeps (2e-12 m), and the hinge at 2 rad leaves its place by 4e-4 rad in 8 s.
    """
    said = set()
    for part in (-1, 0, 1):
        friction = edge * (1 + part * np.finfo(float).eps)
        mechanism = mechanism_named(scene, friction=friction, **parameters)
        found = truth_of(mechanism, np.array([0.0, 0.05]))
        said.add((found.horizon, tuple(found.events)))
    assert said == {(0.0, ())}


def test_routes_share_ends_and_events_and_no_decision() -> None:
    """What happens at an end is told in one place; what holds next, and what an impact does, by each route alone."""
    assert ContactTree.change is ContactBodies.change
    for name in ("begin", "_solution", "_decided", "_struck", "_symbols"):
        assert getattr(ContactTree, name) is not getattr(ContactBodies, name)


def two_pendulums(later: float, restitution: float, *, cart: bool) -> Mechanism:
    """Mirror images that swing onto stops, on the world or on a free cart; the second starts further away by a part."""
    names, carrier = ("left", "right"), "cart" if cart else "world"
    slide = Joint("slide", "prismatic", "world", "cart", axis=(1, 0, 0), q0=(0.0,), v0=(0.0,))
    hinges = [
        Joint(name, "revolute", carrier, name, (0, k, 0), axis=(0, 1, 0), q0=(0.6 * side * (1 + k * later),), v0=(0.0,),
              limits=(-0.2, 1.0) if side > 0 else (-1.0, 0.2), restitution=restitution)
        for k, (name, side) in enumerate(zip(names, (1, -1), strict=True))
    ]  # fmt: skip
    bodies = [Body(name, 1.0, (0, 0, -0.5), 0.1 * np.eye(3)) for name in names]
    if cart:
        bodies, hinges = [Body("cart", 1.0, (0, 0, 0), 0.1 * np.eye(3)), *bodies], [slide, *hinges]
    return Mechanism(tuple(bodies), tuple(hinges), gravity=(0.0, 0.0, -9.81))


def paths_of(mechanism: Mechanism, until: float):
    """Paths of both routes, coarse ones."""
    bodies = ContactBodies(ContactEquations(mechanism, MaximalCoordinates(mechanism).lean), 1e-11, 1.0)
    return [follow(route, until, (), CLOSE) for route in (ContactTree(ContactDynamics(mechanism), 1e-11, 1.0), bodies)]


@pytest.mark.arithmetic
@pytest.mark.parametrize("later", [0.0, 1e-15, -1e-10])
def test_stops_hit_at_once_have_no_outcome_where_one_impact_moves_the_other(later: float) -> None:
    """On a cart the first impact decides what the second does: round-off is not asked which comes first."""
    for path in paths_of(two_pendulums(later, 0.5, cart=True), 0.53):
        assert not path.known
        assert path.stretches[-1].end == pytest.approx(0.521447, abs=1e-6)
        assert "presses left and right at once: its outcome depends on their order" in path.ended


def test_stops_hit_at_once_without_a_rebound_leave_one_motion() -> None:
    """On a cart, pendulums that both stay where they hit do so in either order."""
    paths = paths_of(two_pendulums(1e-12, 0.0, cart=True), 0.53)
    assert first_close(paths, CLOSE) == np.inf
    assert [[item.name for item in path.happenings] for path in paths] == [["left", "right"]] * 2


@pytest.mark.arithmetic
@pytest.mark.parametrize("later", [1e-15, -1e-15])
def test_stops_hit_at_once_by_bodies_apart_are_well_posed(later: float) -> None:
    """What one does nothing to the other: both routes go on, whichever they take first."""
    paths = paths_of(two_pendulums(later, 0.0, cart=False), 0.53)
    assert first_close(paths, CLOSE) == np.inf
    assert followed_paths._parted(*paths, lambda mode: mode) == np.inf
    assert [sorted(item.name for item in path.happenings) for path in paths] == [["left", "right"]] * 2


@pytest.mark.parametrize("extra", [0, 1])
def test_a_stretch_of_no_length_of_one_route_shifts_no_later_stretch(extra: int) -> None:
    """States of both routes are compared in the same stretch where one of them has one more that lasts an instant."""
    modes = [("high", 0.0), ("forward", 1.0), ("high", 1.0 + 1e-12), ("free", 2.0)]
    ends = [1.0, 1.0 + 1e-12, 2.0, 3.0]
    long = [
        Stretch(start, end, mode, np.zeros(1), np.zeros(1), None)
        for (mode, start), end in zip(modes, ends, strict=True)
    ]
    short = [long[0], *long[2:]]
    paths = [HybridPath(tuple(stretches), (), ()) for stretches in ((long, short), (short, long))[extra]]
    stretches = paths[0].stretch_at(np.array([0.5, 1.5, 2.5]))
    others = followed_paths.counterparts((paths[0], paths[1]), stretches)
    assert [paths[1].stretches[number].mode for number in others] == ["high", "high", "free"]


def test_stops_hit_one_after_the_other_are_well_posed() -> None:
    """A difference that a file tells decides which comes first."""
    assert first_close(paths_of(two_pendulums(1e-6, 0.5, cart=True), 0.53), CLOSE) == np.inf


def test_routes_that_agree_by_chance_are_known_to_the_tolerance_of_a_step() -> None:
    """Parabolas that both routes follow to the last digit have a bar of what their steps may be off by."""
    scene = load_scene("stop", height=0.3)
    units, bars = natural_units(scene.elements[0].mechanism), true_motion("stop", [0.0, 0.3], height=0.3).bars  # type: ignore[attr-defined]  # it is one
    assert bars["q"][-1] >= TOLERANCES[0] * units.length
    assert bars["v"][-1] >= TOLERANCES[0] * units.length / units.time


def swing_to_a_stop(inside: float, restitution: float) -> Mechanism:
    """A mass on a spring that reaches 1 m at pi/2, and a stop that lies nearer by some metres."""
    joint = Joint("slide", "prismatic", "world", "mass", axis=(1, 0, 0), v0=(1.0,), stiffness=1.0,
                  limits=(-3.0, 1.0 - inside), restitution=restitution)  # fmt: skip
    return Mechanism((Body("mass", 1.0, inertia=(1.0, 1.0, 1.0)),), (joint,), gravity=(0.0, 0.0, 0.0))


@pytest.mark.one_in(3)
@pytest.mark.arithmetic
@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("inside", [1e-10, 1e-15, 0.0, -1e-15, -1e-12])
def test_a_joint_that_grazes_its_stop_is_ill_posed(inside: float, restitution: float) -> None:
    """Whether it touches is not known, and an impact from a depth d takes sqrt(2 d) of its speed: 1e-6 for 1e-12."""
    found = truth_of(swing_to_a_stop(inside, restitution), np.array([0.0, 2.0]))
    assert found.horizon == pytest.approx(np.pi / 2, abs=1e-4)
    assert found.events == ()


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("-1e-06-0")
@pytest.mark.parametrize(("inside", "impacts"), [(1e-6, 1), (-1e-6, 0)])
def test_a_joint_that_passes_or_misses_its_stop_for_certain_is_well_posed(inside: float, impacts: int) -> None:
    """A thousandth of a millimetre decides; the impact takes all speed, and the mass swings back from there."""
    found = truth_of(swing_to_a_stop(inside, 0.0), np.array([0.0, 2.0]))
    assert np.isinf(found.horizon)
    assert len(found.events) == impacts
    hit, reach = (np.arcsin(1 - inside), 1 - inside) if impacts else (np.pi / 2, 1.0)
    assert all(event.time_low <= hit <= event.time_high for event in found.events)
    assert found.record.q[-1, 0] == pytest.approx(reach * np.cos(2.0 - hit), abs=TIGHT)


@pytest.mark.one_in(3)
@pytest.mark.arithmetic
@pytest.mark.parametrize("apart", [1e-12, 0.0, -1e-12])
def test_spheres_that_graze_each_other_are_ill_posed(apart: float) -> None:
    """Spheres that pass at the sum of their radii, within what lengths are known to, touch or do not."""
    found = true_motion("two_spheres", [0.0, 0.2], passing=0.08 + apart)
    assert found.horizon == pytest.approx(0.12533, abs=1e-4)
    assert found.events == ()


@pytest.mark.nightly
def test_many_joints_at_rest_on_a_body_that_spins() -> None:
    """Eight rubbing joints, at rest on a body that turns and falls, stay or begin to move by one law in both routes."""
    bodies, joints = [Body("trunk", 3.0, inertia=(0.05, 0.06, 0.07))], []
    joints.append(Joint("base", "free", "world", "trunk", q0=(0, 0, 0, 1, 0, 0, 0), v0=(0.3, 0.1, 0.2, 1.0, -2.0, 3.0)))
    for k in range(8):
        com = (0.0, 0.02 * (k % 3), -0.1 - 0.01 * k)
        bodies.append(Body(f"leg{k}", 0.2 + 0.02 * k, com, (0.001, 0.0012, 0.0004)))
        place = (0.2 * np.cos(k), 0.15 * np.sin(k), 0.0)
        axis = (np.cos(2 * k), np.sin(2 * k), 0.3)
        friction = 0.01 if k % 2 else 1.0
        joints.append(
            Joint(f"hip{k}", "revolute", "trunk", f"leg{k}", place, axis=axis, q0=(0.3 * k,), friction=friction)
        )
    found = truth_of(Mechanism(tuple(bodies), tuple(joints)), np.array([0.0, 0.01, 0.02]))
    moving = np.abs(found.record.v[-1, 6:]) > 1e-6
    assert moving.any()
    assert not moving.all()
    assert found.bars["p_WB"][-1] < 1e-12


def test_a_stop_that_nothing_reaches_has_no_force(scene):
    """A motion that ends before its stop has that stop's force, which is zero, in its place among the others."""
    mechanism = scene("stop")
    named = truth_of(mechanism, np.array([0.0, 0.05])).record.named
    assert named.shape == (2, len(named_forces(mechanism)))
    assert not named[:, [item.name.startswith("stop.") for item in named_forces(mechanism)]].any()
