"""Truths of bodies that touch, against the numbers of a laboratory and against the ball's own truth.

The laboratory integrated other equations, in other coordinates, and gave twelve digits.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from feet_on_rails import foot_on_rail
from mechanism_scenes import mechanism_named
from scipy.integrate import quad

from proofroll.core.errors import NotUnique, Refused
from proofroll.core.observable import Role
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism, Spring
from proofroll.elements.mechanism.contact import coulomb
from proofroll.elements.mechanism.contact.modes import modes_of
from proofroll.elements.mechanism.dynamics import switches
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.run.dataset import UNDETERMINED
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.elements.mechanism.scene.composed import Cable
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check.laws import impacts
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.published import true_values

DIGITS = 1e-10  # s, m: of the laboratory's numbers, which have twelve
TIGHT = 1e-10  # s: of events, where 1e-12 is seen
BARS = 1e-9  # of what two routes leave in SI units: 6e-11 is seen, of a rod of 10 µm that falls by 1000 rad/s


def motion(scene: str, times: list[float], **parameters: float) -> TwoRouteMotion:
    """The truth of a scene of one mechanism at these times, with narrow bars."""
    found = truth_of(mechanism_named(scene, **parameters), np.array(times))
    assert np.isinf(found.horizon)
    assert max(float(bar[-1]) for bar in found.bars.values()) < BARS
    return found


def happened(found: TwoRouteMotion) -> list[tuple[str, str]]:
    """Kinds and names of the events."""
    return [(event.kind, event.name) for event in found.events]


def times_of(found: TwoRouteMotion, *expected: float) -> None:
    """Checks the times of the events, each within its own narrow bracket."""
    assert [event.time for event in found.events] == pytest.approx(list(expected), abs=DIGITS)
    for event in found.events:
        assert event.time_low <= event.time <= event.time_high <= event.time_low + TIGHT


@pytest.mark.drill
def test_a_rod_of_ten_micrometres_falls_as_one_of_a_metre_does() -> None:
    """Lengths scale a motion under gravity, and times by their root: no length of a metre is taken for granted."""
    found = motion("falling_rod", [0.0, 0.9 * np.sqrt(1e-5)], half=0.5e-5, foot=0.02e-5)
    assert happened(found) == [("slip", "contact"), ("turn", "contact")]
    times = np.array([event.time for event in found.events]) / np.sqrt(1e-5)
    assert times == pytest.approx(true_values("falling_rod")[0]["events"], abs=DIGITS)


@pytest.mark.drill
def test_a_smooth_ladder_leaves_its_wall_at_two_thirds() -> None:
    """Without friction the sine of its angle is then two thirds of that at the start."""
    found = motion("ladder", [0.0, 0.499337468618, 0.5], floor_friction=0.0, wall_friction=0.0)
    times_of(found, 0.499337468618)
    angle = np.pi / 2 + found.record.q[1, 2]
    assert np.sin(angle) == pytest.approx(2 / 3 * np.sin(1.2), abs=1e-9)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("kind", "room", "mu"), [("free", 1e-6, 0.3), ("planar", 0.25, 0.1)])
def test_a_ball_that_slides_round_a_bore_rolls_when_its_path_says(kind: str, room: float, mu: float) -> None:
    """Friction stops a slip after ln(7/5)/mu of a turn at 5/7 of the speed, however little room and however far."""
    radius, speed = 0.05, 0.1
    ball = Body("ball", 0.3, inertia=(0.4 * 0.3 * radius**2,) * 3)
    if kind == "free":
        joint = Joint("joint", "free", "world", "ball", q0=(room, 0, 0, 1, 0, 0, 0), v0=(0, speed, 0, 0, 0, 0))
    else:
        joint = Joint("joint", "planar", "world", "ball", q0=(room, 0, 0), v0=(0, speed, 0))
    shapes = (
        Geometry("sphere", "ball", "sphere", radius=radius),
        Geometry("wall", "world", "bore", radius=radius + room),
    )
    pair = Pair("contact", ("sphere", "wall"), mu)
    bore = Mechanism((ball,), (joint,), geometries=shapes, pairs=(pair,), gravity=(0.0, 0.0, 0.0))
    rolls = 0.4 * room / (mu * speed)
    found = truth_of(bore, rolls * np.array([0.0, 1.5]))
    assert happened(found) == [("stick", "contact")]
    assert found.events[0].time == pytest.approx(rolls, rel=1e-9)
    assert np.linalg.norm(found.record.v_WB[1, 0]) == pytest.approx(5 / 7 * speed, rel=1e-12)
    way = np.log(7 / 5) / mu + 5 / 7 * speed * 0.5 * rolls / room
    there = room * np.array([np.cos(way), np.sin(way)])
    assert found.record.p_WB[1, 0, :2] == pytest.approx(there, abs=1e-10 * room)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("other", [0.0, 0.3])
def test_a_tip_on_a_turning_arm_rubs_against_its_own_motion(other: float) -> None:
    """It stops its arm on a floor, or takes a disc along for half a turn more: the line of its slip turns with it."""
    load, reach, inertia, mu, spin, torque = 1.01, 0.5, 0.1, 0.2, 4.0, 0.5
    bodies = [Body("slider", 0.01, inertia=(1e-4,) * 3), Body("arm", 1.0, inertia=(inertia,) * 3)]
    joints = [
        Joint("guide", "prismatic", "world", "slider", q0=0.1),  # type: ignore[arg-type]
        Joint("hinge", "revolute", "slider", "arm", v0=spin, torque=torque if other else 0.0),  # type: ignore[arg-type]
    ]
    if other:
        bodies.append(Body("disc", 1.0, inertia=(other,) * 3))
        joints.append(Joint("axle", "revolute", "world", "disc"))
    shapes = (
        Geometry("tip", "arm", "sphere", (reach, 0, -0.1), radius=0.0),
        Geometry("top", "disc" if other else "world", "plane"),
    )
    arm = Mechanism(bodies, joints, geometries=shapes, pairs=(Pair("rubs", ("tip", "top"), mu),))  # type: ignore[arg-type]
    rubs = mu * load * 9.81 * reach
    slows = (rubs - (torque if other else 0.0)) / inertia
    sped = rubs / other if other else 0.0
    stops = spin / (slows + sped)
    found = truth_of(arm, np.array([0.0, stops / 2, stops + 1.0]))
    assert happened(found) == [("stick" if other else "rest", "rubs")]
    times_of(found, stops)
    pushed = torque / (inertia + other) if other else 0.0
    turned = spin * stops - slows * stops**2 / 2 + sped * stops + pushed / 2
    assert found.record.q[2, 1] == pytest.approx(turned, abs=DIGITS)
    assert turned > (np.pi if other else 0.8)
    assert max(float(bar[-1]) for bar in found.bars.values()) < BARS


@pytest.mark.drill
def test_infinitely_many_impacts_end_when_their_sum_says() -> None:
    """A ball that bounces to a fifth of its speed settles after one and a half times the time of its fall."""
    scene = load_scene("bouncing_ball", height=0.05, restitution=0.2, mu_static=0.1)
    found = truth_of(the_mechanism(scene).mechanism, np.array([0.0, 0.2]))
    rests = np.sqrt(2 * 0.05 / 9.81) * (1 + 0.2) / (1 - 0.2)
    assert found.events[-1].kind == "settle"
    assert found.events[-1].time == pytest.approx(rests, abs=DIGITS)
    assert found.record.p_WB[1, 0] == pytest.approx([0, 0, 0.025], abs=1e-15)
    assert found.pressed is not None
    assert found.pressed[1, 0, 2] == pytest.approx(0.517 * 9.81, abs=DIGITS)


@pytest.mark.nightly_of("0.2")
@pytest.mark.nightly
@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_the_error_of_rebounds_cut_short_is_within_the_bars(friction: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Infinitely many rebounds are summed from some on: where that begins changes the motion within its bars."""
    body = Body("ball", 1.0, inertia=(0.016, 0.016, 0.016))
    start = Joint("free", "free", "world", "ball", q0=(0, 0, 0.25, 1, 0, 0, 0), v0=(1.5, 0.5, -1, 2, -1, 3))
    shapes = (Geometry("s", "ball", "sphere", radius=0.2), Geometry("floor", "world", "plane"))
    pairs = (Pair("c", ("s", "floor"), friction=friction, restitution=0.4),)
    ball = Mechanism((body,), (start,), geometries=shapes, pairs=pairs, gravity=(2.0, 1.0, -9.0))
    monkeypatch.setattr(switches, "SETTLED", 1e-3)
    monkeypatch.setattr(impacts, "_SETTLED", 1e-3)  # the law check knows the cut by its own number
    rough = truth_of(ball, np.array([0.0, 0.8]))
    monkeypatch.setattr(switches, "SETTLED", 1e-6)
    monkeypatch.setattr(impacts, "_SETTLED", 1e-6)
    fine = truth_of(ball, np.array([0.0, 0.8]))
    assert "settle" in {event.kind for event in rough.events}
    for field in ("p_WB", "v_WB"):
        off = float(np.abs(getattr(rough.record, field)[-1] - getattr(fine.record, field)[-1]).max())
        assert off < float(rough.bars[field][-1]) < max(100 * off, 1e-12)


def test_friction_that_tears_is_refused() -> None:
    """A rod that slides with friction beyond 4/3 and leans the wrong way has no unique motion (Painlevé)."""
    rod = mechanism_named("falling_rod", friction=2.0)
    leans = -0.55
    joint = replace(rod.joints[0], q0=(0.5 * np.sin(leans), -(0.02 + 0.5 * np.cos(leans)), leans), v0=(1.0, 0.0, 0.0))
    with pytest.raises(Refused, match="Painlevé"):
        truth_of(replace(rod, joints=(joint,)), np.array([0.0, 0.1]))


@pytest.mark.arithmetic
@pytest.mark.parametrize("tilt", [0.0, 1e-11])
def test_a_plank_that_falls_flat_is_refused(tilt: float) -> None:
    """Two corners that an impact presses at once, as far as is known, share it by their order, which nobody knows."""
    block = mechanism_named("rocking_block", friction=0.2)
    flat = replace(block.joints[0], q0=(0.0, -0.3, tilt), v0=(0.0, 0.0, 0.0))
    found = truth_of(replace(block, joints=(flat,)), np.array([0.0, 0.1, 0.3]))
    assert "presses left and right at once" in found.ended
    assert found.record.time.tolist() == [0.0, 0.1]


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_corners_hit_at_once_are_refused_where_only_one_of_them_is_pressed(friction: float) -> None:
    """A turning block lands flat: one impact of both presses the faster corner alone, but either may come first."""
    block = mechanism_named("rocking_block", friction=friction)
    falls, spin = float(np.sqrt(2 * 0.05 / 9.81)), 4.95
    lands = replace(block.joints[0], q0=(0.0, -0.3, -spin * falls), v0=(0.0, 0.0, spin))
    found = truth_of(replace(block, joints=(lands,)), np.array([0.0, 0.1, 0.15]))
    assert "presses left and right at once" in found.ended
    assert found.record.time.tolist() == [0.0, 0.1]


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_disc_that_lands_flat_is_refused(restitution: float) -> None:
    """Its whole edge lands at once: one contact at its centre would stop the routes, or leave it a spin for ever."""
    disc = mechanism_named("tilted_disc")
    flat = replace(disc.joints[0], q0=(0, 0, 0.05, 1, 0, 0, 0), v0=(1, 0, 0, 0, 0, 5))
    pairs = tuple(replace(pair, restitution=restitution) for pair in disc.pairs)
    found = truth_of(replace(disc, joints=(flat,), pairs=pairs), np.array([0.0, 0.1, 0.2]))
    assert re.search(r"^the disc of contact lies flat at t = 0\.10096\d* s: the forces along its edge", found.ended)
    assert found.record.time.tolist() == [0.0, 0.1]


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("friction", [0.0, 2.0])
def test_a_disc_that_tips_until_it_lies_flat_is_refused_with_the_time(friction: float) -> None:
    """A disc let go on its edge falls on its face, on a smooth floor and on one that holds it; it is told when."""
    disc, tilt, radius = mechanism_named("tilted_disc", friction=friction), 0.1, 0.25
    start = (0.0, 0.0, radius * np.sin(tilt), np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0)
    tips = replace(disc.joints[0], q0=tuple(map(float, start)), v0=(0.0,) * 6)

    def slowness(s: float) -> float:
        """Time by the root s of the angle fallen [s]: its energy, with its centre moving down alone if it is smooth."""
        angle = tilt - s**2
        moved = 1.0 if friction else np.cos(angle) ** 2
        return float(2 * s * np.sqrt(radius * (0.25 + moved) / (2 * 9.81 * (np.sin(tilt) - np.sin(angle)))))

    falls = quad(slowness, 1e-12, np.sqrt(tilt))[0]
    found = truth_of(replace(disc, joints=(tips,)), np.array([0.0, 0.2]))
    assert re.search(r"^the disc of contact lies flat at t = \S+ s: the forces along its edge", found.ended)
    assert found.end == pytest.approx(falls, rel=1e-5)


def test_a_smooth_plank_that_falls_flat_rests() -> None:
    """Either end hit first presses the other more and more: without friction and rebound it lies still."""
    plank = mechanism_named("rocking_block", friction=0.0, moment=0.005)
    flat = replace(plank.joints[0], q0=(0.0, -0.3, 0.0), v0=(0.0, 0.0, 0.0))
    found = truth_of(replace(plank, joints=(flat,)), np.array([0.0, 0.2]))
    assert np.isinf(found.horizon)
    times_of(found, *[float(np.sqrt(2 * 0.05 / 9.81))] * 2)
    assert happened(found) == [("impact", "left"), ("impact", "right")]
    assert found.record.p_WB[1, 0] == pytest.approx([0, 0, 0.25], abs=1e-12)
    assert np.abs(found.record.v_WB[1]).max() < 1e-12
    assert found.pressed is not None
    assert found.pressed[1, :, 2] == pytest.approx([4.905, 4.905], abs=DIGITS)


@pytest.mark.drill
def test_early_events_lie_within_their_brackets() -> None:
    """Round-off of a velocity moves an event by as much soon after the start as later; times of an extended solver."""
    inertia = ((0.06, 0, 0), (0, 0.05650875312070695, 0), (0, 0, 0.06))
    q0, v0 = (0.0, -0.4087394445624683, 0.2861112945249649), (0.0639632784680805, 0.0, -1.598387139744071)
    joint = Joint("j", "planar", "world", "rod", axis=(0, 1, 0), second_axis=(1, 0, 0), q0=q0, v0=v0)
    foot = Geometry("foot", "rod", "sphere", (0, 0, -0.4), radius=0.02)
    pair = Pair("contact", ("foot", "floor"), 0.5800967352872851)
    rod = Mechanism(
        (Body("rod", 1.0, inertia=inertia),),
        (joint,),
        geometries=(foot, Geometry("floor", "world", "plane")),
        pairs=(pair,),
    )
    impact, stick = truth_of(rod, np.array([0.0, 0.03])).events
    assert impact.time_low < 0.018937869882948095118 < impact.time_high
    assert stick.time_low < 0.022338284879918976796 < stick.time_high
    assert stick.time_high - stick.time_low < 1e-14


@pytest.mark.nightly
def test_stops_with_friction_beside_contact_are_followed_to_the_stop() -> None:
    """A joint with both stays on its stop, where the shares of what holds it are not determinate."""
    times = np.array([0.0, 0.05, 0.1, 0.2])
    free, far = (truth_of(foot_on_rail(friction=1.0, limits=(-1.0, at)), times) for at in (9.0, 0.1))
    assert np.isinf(free.horizon)
    assert np.isinf(free.end)
    plain = truth_of(foot_on_rail(friction=1.0), times)
    assert free.record.q == pytest.approx(plain.record.q, abs=1e-12)
    assert [item.name for item in named_forces(foot_on_rail(friction=1.0, limits=(-1.0, 9.0)))] == [
        "friction.rail", "stop.rail"
    ]  # fmt: skip
    assert free.record.named[:, 0] == pytest.approx(plain.record.named[:, 0], abs=1e-12)
    assert free.record.named[:, 1] == pytest.approx(0.0, abs=1e-12)
    assert not far.ended
    assert ("impact", "rail") in happened(far)
    assert far.record.q[-1, 0] == pytest.approx(0.1, abs=1e-14)
    assert np.isnan(far.record.named[-1]).all()


@pytest.mark.drill
def test_a_joint_that_rubs_bounces_off_its_stop_beside_contacts() -> None:
    """An impact with restitution leaves the stop, so that nothing is shared there."""
    times = np.array([0.0, 0.05, 0.1, 0.2])
    bounces = truth_of(foot_on_rail(friction=1.0, limits=(-1.0, 0.1), restitution=0.5), times)
    assert ("impact", "rail") in happened(bounces)
    assert np.isinf(bounces.end)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("rail0", "rail2")
@pytest.mark.parametrize(
    "rail",
    [
        {"q0": (0.1,), "torque": Formula("-4*t")},
        {"q0": (0.1,), "torque": 2.0},
        {"v0": (2.0,), "torque": Formula("3*cos(6*t)")},
        {"v0": (2.0,), "stiffness": 30.0},
        {"v0": (2.0,), "restitution": 0.3, "torque": Formula("8-16*t")},
        {"v0": (-2.0,), "limits": (-0.1, 0.5), "restitution": 0.2, "torque": Formula("-6+14*t")},
    ],
)
def test_a_joint_that_rubs_rests_on_its_stop_and_leaves_it_beside_contacts_as_without(rail: dict[str, Any]) -> None:
    """Stop and friction hold it together, and it leaves when both can push no more, as with no contact in the scene."""
    joint = Joint("rail", "prismatic", "world", "cart", axis=(1, 0, 0), friction=1.0, **{"limits": (-0.5, 0.1), **rail})
    shapes = Geometry("ball", "cart", "sphere", radius=0.1), Geometry("floor", "world", "plane", (0.0, 0.0, -5.0))
    alone = Mechanism((Body("cart", 2.0, inertia=(0.1,) * 3),), (joint,))
    beside = replace(alone, geometries=shapes, pairs=(Pair("far", ("ball", "floor"), friction=0.3),))
    one, other = (truth_of(mechanism, np.linspace(0.0, 0.8, 5)) for mechanism in (alone, beside))
    assert other.record.q == pytest.approx(one.record.q, abs=1e-14)
    assert other.record.named == pytest.approx(one.record.named, abs=1e-12, nan_ok=True)
    assert happened(other) == happened(one)
    for a, b in zip(one.events, other.events, strict=True):
        assert a.time_low <= b.time_high
        assert b.time_low <= a.time_high


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("laws0-kinds0")
@pytest.mark.parametrize(
    ("laws", "kinds"), [({"sole": 0.0, "pull": 3.0}, ["impact"]), ({"restitution": 0.5}, ["impact", "turn"])]
)
def test_a_stop_that_is_approached_at_first_is_hit_at_once(laws: dict[str, float], kinds: list[str]) -> None:
    """A joint that starts at its stop and moves into it has an impact at time 0, as it has without contacts."""
    found = truth_of(foot_on_rail(limits=(-1.0, 0.0), **laws), np.array([0.0, 0.3]))
    assert [kind for kind, _ in happened(found)] == kinds
    times_of(found, *[0.0] * len(kinds))
    assert np.isinf(found.horizon)


@pytest.mark.parametrize("laws", [{"friction": 0.05}, {"limits": (-1.0, 0.15)}])
def test_engines_with_laws_of_joints_beside_contacts_are_certified(laws: dict[str, Any]) -> None:
    """MuJoCo's contacts are as the scene says beside laws of joints, and no line holds with nothing compared."""
    scene = load_scene("flick")
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    knuckle, *others = element.mechanism.joints
    stopped = replace(element, mechanism=replace(element.mechanism, joints=(replace(knuckle, **laws), *others)))
    plugin = load_engine("mujoco")
    run = plugin.build(replace(scene, elements=(stopped,)), plugin.presets["geoms"]["tuned"])
    lines = stopped.certify(run.built(), run.sample())
    assert [str(line) for line in lines if not line.holds] == []
    assert {"gaps", "responses of contacts", "acceleration", "forces of contact"} <= {line.quantity for line in lines}
    assert not any(np.isnan(line.expected).all() for line in lines if len(line.expected))


@pytest.mark.nightly
def test_a_finger_that_meets_its_stop_lets_the_ball_go() -> None:
    """A finger with a stop flicks a ball, both routes alike: friction slows it, the stop throws it back."""
    flick = mechanism_named("flick")
    for joint, event in (
        (replace(flick.joints[0], limits=(-1.0, 0.15), restitution=0.3), ("impact", "knuckle")),
        (replace(flick.joints[0], friction=0.05), ("slip", "push")),
    ):
        found = truth_of(replace(flick, joints=(joint, *flick.joints[1:])), np.array([0.0, 0.08]))
        assert event in happened(found)
        assert np.isinf(found.horizon)
        assert max(float(bar[-1]) for bar in found.bars.values()) < BARS


@pytest.mark.drill
def test_a_table_and_the_ball_on_it_keep_their_moment_of_momentum() -> None:
    """A ball that rolls on a free turntable drives it, and what one gains about the axle the other loses."""
    found = motion("free_turntable", [0.0, 0.2])
    assert happened(found) == []
    p, v = found.record.p_WB[:, 1], found.record.v_WB[:, 1]
    spin = found.record.w_WB[:, 0, 2]
    moment = 0.02 * spin + 0.3 * (p[:, 0] * v[:, 1] - p[:, 1] * v[:, 0])
    assert moment == pytest.approx(0.125, abs=DIGITS)
    assert abs(spin[1] - spin[0]) > 0.01
    energy = found.record.placed(mechanism_named("free_turntable")).energy()
    assert energy == pytest.approx(energy[0], abs=DIGITS)


@pytest.mark.drill
def test_a_disc_rolls_on_its_edge_without_loss() -> None:
    """Rolling keeps the energy of a tilted disc, whose edge touches at every time."""
    found = motion("tilted_disc", [0.0, 0.2])
    assert happened(found) == []
    energy = found.record.placed(mechanism_named("tilted_disc")).energy()
    assert energy == pytest.approx(energy[0], abs=DIGITS)
    assert found.pressed is not None
    assert (found.pressed[:, 0, 2] > 0).all()


def sliding_box(
    v: tuple[float, float],
    *,
    spin: float = 0.0,
    mu: float = 0.3,
    tilt: float = 0.0,
    com: tuple[float, float] = (0.0, 0.0),
) -> Mechanism:
    """A cube on its four corners that slides with a velocity [m/s], on a plane that falls towards +x."""
    box = Body("box", 2.0, (*com, 0.0), inertia=(0.02, 0.02, 0.02))
    free = Joint("free", "free", "world", "box", q0=(0, 0, 0.1, 1, 0, 0, 0), v0=(*v, 0, 0, 0, spin))
    corners = [(x, y, -0.1) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    feet = [Geometry(f"foot{k}", "box", "sphere", corner, radius=0.0) for k, corner in enumerate(corners)]
    pairs = tuple(Pair(f"touch{k}", (f"foot{k}", "floor"), friction=mu) for k in range(4))
    gravity = (9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt))
    shapes = (Geometry("floor", "world", "plane"), *feet)
    return Mechanism((box,), (free,), gravity=gravity, geometries=shapes, pairs=pairs)


@pytest.mark.nightly
def test_a_box_that_slides_straight_on_four_corners_stops_where_coulomb_says() -> None:
    """Friction brakes it by mu g however its corners share the load; what each of them carries is not told."""
    found = truth_of(sliding_box((0.8, 0.6)), np.array([0.0, 0.1, 0.5]))
    stops = 1 / (0.3 * 9.81)
    assert happened(found) == [("rest", f"touch{k}") for k in range(4)]
    times_of(found, *[stops] * 4)
    assert np.isinf(found.horizon)
    way = 0.1 - 0.3 * 9.81 * 0.1**2 / 2
    assert found.record.p_WB[1:, 0] == pytest.approx(
        np.array([[0.8 * way, 0.6 * way, 0.1], [0.4 * stops, 0.3 * stops, 0.1]]), abs=DIGITS
    )
    assert max(float(bar[-1]) for bar in found.bars.values()) < BARS
    assert found.pressed is not None
    assert np.isnan(found.pressed[..., :3]).all()


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("mu", "tilt"), [(0.0, 0.0), (0.0, 0.3), (0.1, 0.3)])
def test_a_box_slides_straight_down_a_slope(mu: float, tilt: float) -> None:
    """A box that is heavier at one corner moves as a point does, though the smallest forces would pull at the other."""
    found = truth_of(sliding_box((1.0, 0.0), mu=mu, tilt=tilt, com=(0.06, 0.06)), np.array([0.0, 0.1]))
    pull = 9.81 * (np.sin(tilt) - mu * np.cos(tilt))
    assert np.isinf(found.horizon)
    assert found.record.p_WB[1, 0] == pytest.approx([0.1 + pull * 0.1**2 / 2, 0.0, 0.1], abs=DIGITS)
    assert happened(found) == []
    assert max(float(bar[-1]) for bar in found.bars.values()) < BARS


@pytest.mark.drill
def test_a_bead_that_slides_straight_up_a_slope_turns_and_slides_down() -> None:
    """Where friction does not hold it, its slip turns at the top, though its surface lets it slide anywhere."""
    tilt, mu = 0.5, 0.2
    free = Joint("free", "free", "world", "bead", q0=(0, 0, 0, 1, 0, 0, 0), v0=(-0.6, 0, 0, 0, 0, 0))
    shapes = (Geometry("floor", "world", "plane"), Geometry("tip", "bead", "sphere", radius=0.0))
    found = truth_of(
        Mechanism(
            (Body("bead", 2.0, inertia=(0.02, 0.02, 0.02)),),
            (free,),
            gravity=(9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt)),
            geometries=shapes,
            pairs=(Pair("touch", ("tip", "floor"), friction=mu),),
        ),
        np.array([0.0, 0.3]),
    )
    top = 0.6 / (9.81 * (np.sin(tilt) + mu * np.cos(tilt)))
    pull = 9.81 * (np.sin(tilt) - mu * np.cos(tilt))
    assert happened(found) == [("turn", "touch")]
    times_of(found, top)
    assert found.record.p_WB[1, 0, 0] == pytest.approx(-0.3 * top + pull * (0.3 - top) ** 2 / 2, abs=DIGITS)


@pytest.mark.drill
def test_a_box_that_turns_as_it_slides_on_four_corners_is_ill_posed_and_certified() -> None:
    """Each split of its load brakes its turn otherwise, the reason says; round-off fails no certificate."""
    mechanism = sliding_box((0.8, 0.6), spin=1.0)
    found = truth_of(mechanism, np.array([0.0, 1e-4]))
    assert found.horizon == 0
    assert "touch0, touch1, touch2, touch3 carry the load together" in found.reason
    run = simulate(Scene("box", "", (MechanismElement(mechanism),)), "projection", until=1e-4, every=1e-4)
    assert run.attrs["status"] == "done", run.attrs["message"]


@pytest.mark.nightly
def test_a_box_that_begins_to_turn_as_it_slides_is_ill_posed_from_there_on() -> None:
    """A spring off its middle turns a box that slid straight: its truth ends where the split first counts."""
    pull = Spring("pull", "world", "box", (0.0, 3.0, 0.1), (0.1, 0.0, 0.0), stiffness=0.5, length=2.9)
    box = replace(sliding_box((1.0, 0.0)), springs=(pull,))
    found = truth_of(box, np.array([0.0, 1e-5, 0.1]))
    assert 1e-5 < found.horizon < 1e-2
    assert "touch0, touch1, touch2, touch3 carry the load together" in found.reason
    assert found.bars["p_WB"][1] < DIGITS


@pytest.mark.drill
def test_a_row_of_balls_ends_at_its_impact_and_keeps_momentum_and_energy() -> None:
    """Whichever of two impacts at once comes first decides where balls go: only what no order changes can be judged."""
    scene = load_scene("cradle")
    found = truth(scene, np.linspace(0.0, 0.2, 5))
    assert found.sizes["time"] == 2
    assert "impacts in turn and at once differ by 0.25" in found.attrs["ended"]
    element = scene.elements[0]
    laws = [item for item in element.observables if item.role is Role.RESIDUAL]
    assert {"momentum_error", "angular_momentum_error", "energy_gain", "penetration"} <= {item.name for item in laws}
    for item in laws:
        assert not item.hangs_on_events  # so they are judged though the truth is ill-posed
        assert np.abs(found[item.name].to_numpy()).max() < 1e-9


@pytest.mark.drill
def test_a_rod_that_leans_against_its_slip_has_no_truth() -> None:
    """Where a normal force would tear, the scene is refused with the reason, and below that friction it is not."""
    with pytest.raises(NotUnique, match=r"^contact would not press but tear from t = 0 s on: .* \(Painlevé\)$"):
        truth_of(mechanism_named("painleve_rod"), np.array([0.0, 0.01]))
    motion("painleve_rod", [0.0, 0.01], friction=0.5)


@pytest.mark.drill
def test_the_sum_of_forces_at_corners_is_known_where_their_split_is_not() -> None:
    """A cube at rest presses with its weight, though no equation says how its corners share that."""
    body = Body("cube", 10.0, inertia=(0.3, 0.3, 0.3))
    start = Joint("free", "free", "world", "cube", q0=(0, 0, 0.2, 1, 0, 0, 0))
    shapes = (Geometry("hull", "cube", "box", size=(0.4, 0.4, 0.4)), Geometry("floor", "world", "plane"))
    pairs = (Pair("touch", ("hull", "floor"), friction=1.0),)
    element = MechanismElement(Mechanism((body,), (start,), geometries=shapes, pairs=pairs))
    found = MechanismTruth.truth(element, np.array([0.0, 0.5, 1.0]), ())
    assert found["force.touch.z"].to_numpy() == pytest.approx(98.1, abs=1e-9)
    assert found["force.touch.z"].attrs["error_bar"] < 1e-9
    assert np.isnan(found["force.touch.1.z"].to_numpy()).all()
    assert found["pair_forces"].shape == (3, 1, 3)
    assert found["pair_forces"].attrs["error_bar"] < 1e-9


@pytest.mark.drill
def test_the_sum_of_parallel_cables_is_given_by_name_where_no_single_pull_is_known() -> None:
    """A box on four cables hangs by its weight, and what is not determinate at the last time says so."""
    box = Body("box", 5.0, inertia=(0.8, 0.8, 0.8))
    start = Joint("free", "free", "world", "box", q0=(0, 0, 2, 1, 0, 0, 0))
    ends = [(x, y) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]
    shapes, pairs = [], []
    for k, end in enumerate(ends):
        cable = Cable(f"t{k}", "world", "box", position_a=(*end, 5.0), position_b=(*end, 0.5), at_most=2.5).parts()
        shapes += cable["geometries"]
        pairs += cable["pairs"]
    mechanism = Mechanism((box,), (start,), gravity=(0.0, 0.0, -9.81), geometries=tuple(shapes), pairs=tuple(pairs))
    element = MechanismElement(mechanism)
    found = MechanismTruth.truth(element, np.array([0.0, 0.1]), ())
    assert found["net_force.box.z"].to_numpy() == pytest.approx(49.05, abs=1e-9)
    assert found["net_force.box.z"].attrs["error_bar"] < 1e-9
    assert found["force.t1.z"].attrs["absent"] == UNDETERMINED


def test_what_has_no_truth_is_held_to_the_laws_of_contact_alone() -> None:
    """Where no law says what follows, nothing is known of the motion, and what breaks a law of contact is an error."""
    scene = load_scene("painleve_rod")
    found = truth(scene, np.array([0.0, 0.01]))
    assert "Painlevé" in found.attrs["ill_posed"]
    (element,) = scene.elements
    laws = {"penetration", "cone_excess", "energy_gain", "natural_map"}
    judged = element.observe(found)
    assert laws <= set(judged)
    assert not {"positions", "v_WB", "normal_forces", "gaps"} & set(judged)
    assert all(np.all(values == 0.0) for name, values in judged.items() if name in laws)
    for engine, formulation in (("mujoco", "geoms"), ("pinocchio", "impulses")):
        plugin = load_engine(engine)
        run = plugin.build(scene, plugin.presets[formulation]["matched"])
        lines = element.certify(run.built(), run.sample())  # what contacts do first is asked of none
        assert [str(line) for line in lines if not line.holds] == []


def test_what_no_route_follows_is_refused_and_not_called_ill_posed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene whose laws have one answer that is merely not found is refused with the reason, its engines are not."""
    table = load_scene("free_turntable")
    (element,) = table.elements
    assert isinstance(element, MechanismElement)
    axle = replace(element.mechanism.joints[0], friction=0.1, limits=(-9.0, 0.0), v0=(0.0,))
    rubs = replace(element, mechanism=replace(element.mechanism, joints=(axle, *element.mechanism.joints[1:])))
    assert np.isfinite(rubs.first_motion.acceleration).all()  # of the axle on its stop, which rubs
    monkeypatch.setattr(coulomb, "_SWEEPS", 0)
    rod = load_scene("falling_rod")  # its foot sticks, so that no program finds its force either
    (element,) = rod.elements
    assert isinstance(element, MechanismElement)
    with pytest.raises(Refused, match="are not found in 0 sweeps"):
        truth(rod, np.array([0.0, 0.1]))
    assert np.isnan(replace(element).first_motion.acceleration).all()


@pytest.mark.drill
def test_residuals_of_the_truth_are_within_their_bars() -> None:
    """Each residual of Coulomb's law, which is zero for the truth, is no larger than its own error bar says."""
    found = truth(load_scene("sled"), np.array([0.0, 0.1, 0.2]))
    for name in ("penetration", "contact_pull", "cone_excess", "friction_direction", "hop_speed", "natural_map"):
        bar = found[name].attrs["error_bar"]
        assert 0 < bar < 1e-5, name
        assert float(np.nanmax(np.abs(found[name].to_numpy()))) <= bar, name


@pytest.mark.one_in(2)
@pytest.mark.arithmetic
@pytest.mark.parametrize("part", [-20, -1, 0, 1])
def test_a_ball_that_just_rolls_is_ill_posed(part: int) -> None:
    """Friction of 2/7 of the slope, to round-off: whether the contact sticks hangs on nothing, on both sides alike."""
    friction = 2 / 7 * np.tan(0.3) * (1 + part * np.finfo(float).eps)
    ball = mechanism_named("inclined_plane", tilt=0.3, speed=0.0, mu_static=float(friction))
    found = truth_of(ball, np.array([0.0, 0.1]))
    assert (found.horizon, tuple(found.events)) == (0.0, ())


@pytest.mark.drill
def test_a_pendulum_rebounds_from_a_wall_by_newtons_law_whatever_the_friction() -> None:
    """Its one velocity after an impact is -e times that before; gap and slip of its tip have the bars of its angle."""
    rod = Body("rod", 1.0, (0, 0, -0.5), np.diag([1 / 12, 1 / 12, 1e-3]))
    hinge = Joint("hinge", "revolute", "world", "rod", axis=(0, 1, 0), q0=(1.0,))
    tip = Geometry("tip", "rod", "sphere", (0, 0, -1.0), radius=0.05)
    wall = Geometry("wall", "world", "plane", (0.05, 0, 0), normal=(-1.0, 0, 0))
    pair = Pair("hit", ("tip", "wall"), friction=0.3, restitution=0.7)
    pendulum = Mechanism(bodies=(rod,), joints=(hinge,), geometries=(tip, wall), pairs=(pair,))
    fall = 9.81 * (1 - np.cos(1.0))
    found = truth_of(pendulum, np.array([0.0, 0.5, 1.0]))
    assert happened(found) == [("impact", "hit")]
    assert found.record.placed(pendulum).energy()[-1] == pytest.approx(
        -9.81 / 2 + 0.49 * fall / 2, abs=float(found.bars["energy"][-1])
    )
    assert max(float(bar[-1]) for bar in found.bars.values()) < BARS
    element = MechanismElement(pendulum)
    dataset = truth(Scene("pendulum", "", (element,)), np.array([0.0, 0.5, 1.0]))
    bar = {name: variable.attrs.get("error_bar") for name, variable in dataset.data_vars.items()}
    assert bar["gap.hit"] >= bar["q.hinge"]
    assert bar["slip.hit"] >= bar["v.hinge"]


@pytest.mark.nightly
def test_a_capsule_slides_and_rolls_on_both_its_ends() -> None:
    """Its ends share what holds them along its axis in many ways; its motion is the one of a roller all the same."""
    mass, inertia, radius, mu = 0.5, 6e-4, 0.05, 0.3
    body = Body("capsule", mass, inertia=(2e-3, inertia, 2e-3))
    start = Joint("free", "free", "world", "capsule", q0=(0, 0, radius, 1, 0, 0, 0), v0=(1, 0, 0, 0, 0, 0))
    ends = [Geometry(name, "capsule", "sphere", (0, y, 0), radius=radius) for name, y in (("a", 0.1), ("b", -0.1))]
    pairs = tuple(Pair(end.name, (end.name, "floor"), friction=mu) for end in ends)
    floor = Geometry("floor", "world", "plane")
    roller = Mechanism(bodies=(body,), joints=(start,), geometries=(*ends, floor), pairs=pairs)
    found = truth_of(roller, np.array([0.0, 0.05, 0.5]))
    rolls = 1 / (mu * 9.81 * (1 + mass * radius**2 / inertia))
    assert happened(found) == [("stick", "a"), ("stick", "b")]
    times_of(found, rolls, rolls)
    speed = 1 - mu * 9.81 * rolls
    assert found.record.p_WB[2, 0, 0] == pytest.approx((1 + speed) / 2 * rolls + speed * (0.5 - rolls), abs=DIGITS)
    assert max(float(bar[-1]) for bar in found.bars.values()) < BARS
    assert found.pressed is not None
    assert found.pressed[2, :, 2] == pytest.approx(mass * 9.81 / 2, abs=DIGITS)
    assert np.isnan(found.pressed[2, :, 1]).all()


def test_an_impact_on_one_edge_of_a_face_opens_the_other() -> None:
    """A turning box whose face is down lands on the two corners that come, and its other two lift."""
    body = Body("box", 1.0, inertia=(2e-3, 3e-3, 4e-3))
    start = Joint("free", "free", "world", "box", q0=(0, 0, 0.05, 1, 0, 0, 0), v0=(0.3, 0.1, 0, 0, 1, 0))
    shapes = (Geometry("hull", "box", "box", size=(0.2, 0.1, 0.1)), Geometry("floor", "world", "plane"))
    pairs = (Pair("ground", ("hull", "floor"), friction=0.1),)
    box = Mechanism(bodies=(body,), joints=(start,), geometries=shapes, pairs=pairs)
    equations = ContactEquations(box, MaximalCoordinates(box).lean)
    bodies = ContactBodies(equations, 3e-14, 1.0)
    state = np.append(equations.equations.equations.start(), 0.0)
    closed = [each.gap < 1e-9 for each in equations.at(state).touching]
    assert sum(closed) == 4
    rough = modes_of(closed, closed, (0,) * 8)
    _, stays, _ = bodies._struck(state, rough, [0.0] * 8, [0.0] * 8)
    assert sum(stays) == 2


@pytest.mark.drill
def test_a_finger_pushes_a_ball_and_lets_go() -> None:
    """A servo at its limit pushes a ball over a floor; the tip slips on it, and the bars stay narrow."""
    found = motion("flick", [0.0, 0.07])
    assert happened(found) == [("slip", "push")]
    times_of(found, 0.060258231738)
    assert found.record.named[:, 0] == pytest.approx([0.6, 0.6], abs=1e-14)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("finger", "swing", "mass"),
    [
        (0.08, 0.5, 0.15),
        pytest.param(0.1, 0.8, 0.1, marks=pytest.mark.nightly),
        pytest.param(0.12, 0.9, 0.08, marks=pytest.mark.nightly),
    ],
)
def test_a_flicked_ball_has_narrow_bars_at_other_numbers(finger: float, swing: float, mass: float) -> None:
    """Both routes agree to 1e-9 over the whole motion, with an effort that leaves its limits and comes back."""
    flicked = mechanism_named("flick", finger_friction=finger, swing=swing, mass=mass)
    found = truth_of(flicked, np.linspace(0.0, 0.4, 5))
    assert np.isinf(found.horizon)
    assert {("lift_off", "push"), ("stick", "ground")} <= set(happened(found))
    assert max(float(bar[-1]) for bar in found.bars.values()) < 1e-9


def dropped_box(
    turned: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0),
    *,
    height: float = 0.1,
    slip: float = 0.0,
    friction: float = 0.5,
    restitution: float = 0.0,
    **changed: Any,
) -> Mechanism:
    """A box of 0.4 m × 0.3 m × 0.2 m whose lowest corner is at a height above a floor."""
    size = (0.4, 0.3, 0.2)
    w, x, y, z = turned
    vertical = np.array([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)])
    above = float(np.abs(vertical) @ np.array(size) / 2) + height
    mechanism = Mechanism(
        bodies=(Body("box", 2.0, inertia=(13 / 600, 20 / 600, 25 / 600)),),
        joints=(Joint("free", "free", "world", "box", q0=(0, 0, above, *turned), v0=(slip, 0, 0, 0, 0, 0)),),
        geometries=(Geometry("hull", "box", "box", size=size), Geometry("floor", "world", "plane")),
        pairs=(Pair("touch", ("hull", "floor"), friction=friction, restitution=restitution),),
    )
    return replace(mechanism, **changed)


@pytest.mark.drill
@pytest.mark.nightly_of("2.0", "0.0")
@pytest.mark.parametrize("slip", [0.0, 0.3, pytest.param(2.0, marks=pytest.mark.drill)])
def test_a_box_that_lands_flat_has_a_truth_to_its_rest(slip: float) -> None:
    """Its face lands as one: it stops at once if friction can do that, or slides on by Coulomb's law."""
    falls, impulse, mu = float(np.sqrt(0.2 / 9.81)), float(np.sqrt(0.2 * 9.81)), 0.5
    slides = max(slip - mu * impulse, 0.0)
    found = truth_of(dropped_box(slip=slip, friction=mu), np.array([0.0, 0.1, 1.0]))
    assert (found.ended, found.horizon) == ("", np.inf)
    assert [(event.kind, event.time) for event in found.events[:4]] == [
        ("impact", pytest.approx(falls, abs=DIGITS))
    ] * 4
    assert found.record.p_WB[2, 0] == pytest.approx([slip * falls + slides**2 / (2 * mu * 9.81), 0, 0.1], abs=DIGITS)
    assert np.abs(found.record.v_WB[2]).max() < DIGITS


@pytest.mark.parametrize("impacts", ["any order", "together"])
def test_two_feet_that_land_at_once_have_an_outcome_where_no_order_decides(impacts: str) -> None:
    """A plank whose ends are two contacts falls flat: where its order decides the truth ends, unless it has none."""
    block = mechanism_named("rocking_block", friction=0.2)
    flat = replace(block.joints[0], q0=(0.0, -0.3, 0.0), v0=(0.0, 0.0, 0.0))
    found = truth_of(replace(block, joints=(flat,), impacts=impacts), np.array([0.0, 0.1, 0.3]))
    assert ("its outcome depends on their order" in found.ended) == (impacts == "any order")
    if impacts == "together":
        assert np.abs(found.record.v_WB[2]).max() < DIGITS


def on_a_ring_of_feet(count: int, speed: float, spin: float = 0.0) -> Mechanism:
    """A plate on as many feet, in a ring, with a speed [m/s] along (3, 4)/5 and a spin [rad/s]."""
    plate = Body("plate", 2.0, (0.0, 0.0, 0.0), inertia=(0.02, 0.03, 0.04))
    v0 = (0.6 * speed, 0.8 * speed, 0, 0, 0, spin)
    free = Joint("free", "free", "world", "plate", q0=(0, 0, 0.1, 1, 0, 0, 0), v0=v0)
    places = [(0.2 * np.cos(x), 0.15 * np.sin(x), -0.08) for x in 2 * np.pi * np.arange(count) / count]
    feet = [Geometry(f"foot{k}", "plate", "sphere", place, radius=0.02) for k, place in enumerate(places)]
    pairs = tuple(Pair(f"touch{k}", (f"foot{k}", "floor"), friction=0.3) for k in range(count))
    shapes = (Geometry("floor", "world", "plane"), *feet)
    return Mechanism((plate,), (free,), gravity=(0.0, 0.0, -9.81), geometries=shapes, pairs=pairs)


@pytest.mark.nightly
def test_a_plate_slides_straight_on_eight_feet() -> None:
    """More contacts than all modes can be tried of have an answer: the plate moves as a point that friction brakes."""
    found = truth_of(on_a_ring_of_feet(8, 1.0), np.array([0.0, 0.05]))
    assert np.isinf(found.horizon)
    way = 0.05 - 0.3 * 9.81 * 0.05**2 / 2
    assert found.record.p_WB[1, 0] == pytest.approx([0.6 * way, 0.8 * way, 0.1], abs=DIGITS)


@pytest.mark.one_in(2)
@pytest.mark.nightly
@pytest.mark.drill_of("0.01")
@pytest.mark.parametrize("spinning", [0.0, 0.01])
def test_feet_that_resist_rolling_leave_the_turn_of_a_plate_open_unless_they_hold_its_spin(spinning: float) -> None:
    """Moments against rolling split the load anyhow; friction then turns the plate, up to μ times their bound."""
    plate = on_a_ring_of_feet(4, 1.0)
    pairs = tuple(replace(pair, rolling_resistance=0.005, spinning_friction=spinning) for pair in plate.pairs)
    found = truth_of(replace(plate, pairs=pairs), np.array([0.0, 0.02]))
    if not spinning:
        assert found.horizon == 0.0
        assert "(without rolling_resistance a body on three points" in found.reason
        return
    way = 0.02 - 0.3 * 9.81 * 0.02**2 / 2
    assert found.record.p_WB[1, 0] == pytest.approx([0.6 * way, 0.8 * way, 0.1], abs=DIGITS)
    assert max(found.bars["p_WB"]) < DIGITS


def test_a_plate_that_turns_on_thirty_two_feet_has_no_determinate_friction() -> None:
    """A true reason, and soon: feet that slide in different directions share the load in more ways than one."""
    found = truth_of(on_a_ring_of_feet(32, 1.0, spin=2.0), np.array([0.0, 0.05]))
    assert found.horizon == 0.0
    assert "carry the load together in more ways than one" in found.reason


@pytest.mark.nightly
def test_a_box_that_lands_on_an_edge_tips_on_its_face_and_rests() -> None:
    """Both corners of the edge land, then both of the other edge, and all four share the weight."""
    turned = (float(np.cos(0.15)), 0.0, float(np.sin(0.15)), 0.0)
    found = truth_of(dropped_box(turned), np.array([0.0, 0.1, 1.0]))
    assert (found.ended, found.horizon) == ("", np.inf)
    kinds = [event.kind for event in found.events]
    assert kinds == ["impact"] * 4 + ["rest"] * 2
    assert found.record.p_WB[2, 0, 2] == pytest.approx(0.1, abs=DIGITS)
    assert found.record.q_WB[2, 0] == pytest.approx([1, 0, 0, 0], abs=DIGITS)


@pytest.mark.nightly
def test_a_box_that_lands_on_a_cart_moves_on_with_it() -> None:
    """Momentum along the rail is shared: four corners stick on a plate that moves."""
    box = dropped_box()
    cart = Joint("rail", "prismatic", "world", "cart", axis=(1, 0, 0), v0=(0.5,))
    bodies = (*box.bodies, Body("cart", 50.0, inertia=(1.0, 1.0, 1.0)))
    floor = replace(box.geometries[1], body="cart")
    moving = replace(box, bodies=bodies, joints=(*box.joints, cart), geometries=(box.geometries[0], floor))
    found = truth_of(moving, np.array([0.0, 0.1, 1.0]))
    assert (found.ended, found.horizon) == ("", np.inf)
    assert found.record.v_WB[2, :, 0] == pytest.approx(0.5 * 50 / 52, abs=DIGITS)


@pytest.mark.nightly
def test_a_box_that_bounces_flat_comes_to_rest_when_its_rebounds_are_summed() -> None:
    """With e = 1/2 the flights last 2 e^n t, t the fall: at 3 t it rests, flat, where it was dropped."""
    falls = float(np.sqrt(0.2 / 9.81))
    found = truth_of(dropped_box(restitution=0.5), np.array([0.0, 0.1, 1.0]))
    assert (found.ended, found.horizon) == ("", np.inf)
    settled = [event.time for event in found.events if event.kind == "settle"]
    assert settled == [pytest.approx(3 * falls, abs=DIGITS)] * 4
    assert found.record.p_WB[2, 0] == pytest.approx([0, 0, 0.1], abs=DIGITS)


@pytest.mark.drill
def test_what_begins_to_move_slowly_beside_bodies_at_rest_is_followed() -> None:
    """A pole 1e-11 rad from upright falls away from there while a ball rests: q = q0 cosh(t sqrt(m g s / I))."""
    pole, ball = Body("pole", 1.0, com=(0.0, 0.0, 0.5), inertia=(0.1,) * 3), Body("ball", 1.0, inertia=(0.01,) * 3)
    hinge = Joint("hinge", "revolute", "world", "pole", axis=(0.0, 1.0, 0.0), q0=(1e-11,))
    free = Joint("free", "free", "world", "ball", q0=(5.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0))
    shapes = Geometry("floor", "world", "plane"), Geometry("skin", "ball", "sphere", radius=0.1)
    pairs = (Pair("touch", ("skin", "floor"), friction=0.5),)
    mechanism = Mechanism((pole, ball), (hinge, free), geometries=shapes, pairs=pairs, gravity=(0.0, 0.0, -9.81))
    found = truth_of(mechanism, np.array([0.0, 1.5]))
    assert found.record.q[-1, 0] == pytest.approx(1e-11 * np.cosh(1.5 * np.sqrt(9.81 * 0.5 / 0.35)), rel=1e-3)
