"""Bodies that touch, by the projection method: switches located within a step, at the order of its steps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from feet_on_rails import foot_on_rail
from scipy.integrate import solve_ivp

from proofroll.core.errors import Diverged, Refused
from proofroll.core.first_steps import first_steps
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.modes import Acting
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.engines.projection.contact.contact_modes import ContactMotion
from proofroll.engines.projection.contact.slip_directions import SlipDirections
from proofroll.files.scene_file import load_scene
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.published import true_values

PROJECTION = load_engine("projection")
DEFAULT = PROJECTION.presets["dependent"]["default"]


@pytest.mark.drill
def test_a_sled_turns_about_a_foot_and_rests() -> None:
    """One foot stops, then all: place of rest and events are those of two routes, at steps of 1e-3 s of order 4."""
    run = PROJECTION.build(load_scene("sled"), DEFAULT)
    run.advance(0.7)
    (true,) = true_values("sled")
    assert np.hypot(*(run.sample().p_WB[0, :2] - true["values"]["p_WB"][:2])) < 1e-5
    first, *others = run.events()
    assert (first.kind, first.name) == ("stick", "right")
    assert first.time_low <= true["events"][0] <= first.time_high
    assert {(item.kind, item.name) for item in others} == {("rest", "left"), ("rest", "back")}
    N = np.linalg.solve([np.ones(3), (0.15, 0.15, -0.20), (0.10, -0.10, 0.03)], (2 * 9.81, 0, 0))
    np.testing.assert_allclose(run.sample().contact_force[:, 2], N, rtol=1e-6)


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("name", "kind", "contact"),
    [
        ("falling_rod", "slip", "contact"),
        pytest.param("ladder", "lift_off", "top", marks=pytest.mark.drill),
        ("rocking_block", "impact", "left"),
        ("spinning_bounce", "impact", "contact"),
    ],
)
def test_the_first_switch_is_where_two_routes_have_it(name: str, kind: str, contact: str) -> None:
    """The first change of each scene comes at its time to 1e-7 s, of its kind and at its contact."""
    time = true_values(name)[0]["events"][0]
    run = PROJECTION.build(load_scene(name), replace(DEFAULT, dt=2e-3))
    run.advance(np.ceil(time / 2e-3) * 2e-3)
    event = run.events()[0]
    assert (event.kind, event.name) == (kind, contact)
    assert event.time == pytest.approx(time, abs=1e-7)


@pytest.mark.parametrize("factor", [-1.0, 0.0, 1.01])
def test_a_wrong_first_force_is_not_certified(factor: float) -> None:
    """A force of contact that is on the other body, left out, or a hundredth too large is told by the certificate."""
    (element,) = load_scene("sled").elements
    assert isinstance(element, MechanismElement)
    run = PROJECTION.build(load_scene("sled"), DEFAULT)
    sample = run.sample()
    wrong = replace(sample, contact_force=factor * sample.contact_force)
    assert [line.quantity for line in element.certify(run.built(), sample) if not line.holds] == []
    assert [line.quantity for line in element.certify(run.built(), wrong) if not line.holds] == ["forces of contact"]


def test_contacts_beside_couplings_are_refused() -> None:
    """A coupling beside contacts is refused in a line that says what is followed."""
    coupled = replace(foot_on_rail(), couplings=(Coupling("belt", "rail", "shaft", 1.0, 0.1),))
    with pytest.raises(Refused, match="contacts are followed in trees"):
        PROJECTION.build(coupled, DEFAULT)


LENGTH, HEIGHT, MASS, INERTIA, RUBS, RETURNS, RADIUS = 0.5, 0.2, 0.7, 0.02, 0.3, 0.6, 0.03


def hinged_rod() -> Mechanism:
    """A rod on a rubbing hinge, whose round tip falls on a rough floor and rebounds."""
    return Mechanism(
        bodies=(Body("rod", MASS, com=(LENGTH / 2, 0, 0), inertia=(INERTIA, INERTIA, INERTIA)),),
        joints=(
            Joint(
                "hinge", "revolute", "world", "rod", axis=(0, 1, 0), position=(0, 0, HEIGHT), q0=(-0.2,), friction=RUBS
            ),
        ),
        geometries=(
            Geometry("tip", "rod", "sphere", position=(LENGTH, 0, 0), radius=RADIUS),
            Geometry("floor", "world", "plane"),
        ),
        pairs=(Pair("tip", ("tip", "floor"), friction=0.3, restitution=RETURNS),),
        gravity=(0, 0, -9.81),
    )


def bounces(until: float) -> tuple[float, list[float]]:
    """Angle of :func:`hinged_rod` at ``until`` [s], and times of its changes, by an own equation of one coordinate."""
    inertia, moment = INERTIA + MASS * LENGTH**2 / 4, MASS * 9.81 * LENGTH / 2
    t, y, changes, ends = 0.0, [-0.2, 0.0], list[float](), list[Any]()
    ends += [lambda _, y: LENGTH * np.sin(y[0]) - (HEIGHT - RADIUS), lambda _, y: y[1]]  # touches; turns
    for end in ends:
        end.terminal, end.direction = True, 1
    while t < until:
        falls = len(changes) % 2 == 0
        friction = -RUBS if falls else RUBS

        def rate(_: float, y: Any, friction: float = friction) -> list[float]:
            return [y[1], (moment * np.cos(y[0]) + friction) / inertia]

        found = solve_ivp(rate, (t, until), y, "DOP853", rtol=3e-14, atol=1e-15, events=ends[0] if falls else ends[1])
        t, y = float(found.t[-1]), [float(found.y[0, -1]), -RETURNS * float(found.y[1, -1]) if falls else 0.0]
        changes += [t] if found.status == 1 else []
    return y[0], changes


@pytest.mark.nightly
def test_a_rod_on_a_rubbing_hinge_bounces_as_an_own_solver_says() -> None:
    """Both routes of the truth, and projection at steps of 2e-3 s, have the angle and events of one own equation."""
    angle, changes = bounces(0.45)
    kinds = [("impact", "tip"), ("turn", "hinge"), ("turn", "hinge"), ("impact", "tip"), ("turn", "hinge")]
    times = [changes[k] for k in (0, 0, 1, 2, 2)]
    true = truth_of(hinged_rod(), np.array([0.0, 0.45]))
    assert np.isinf(true.horizon)
    assert true.record.q[1, 0] == pytest.approx(angle, abs=1e-12)
    run = PROJECTION.build(hinged_rod(), replace(DEFAULT, dt=2e-3))
    run.advance(0.45)
    q = run.sample().q_WB[0]
    assert 2 * np.arctan2(q[2], q[0]) == pytest.approx(angle, abs=1e-9)  # 1e-11 is seen
    for events, bound in ((true.events, 1e-12), (run.events(), 1e-9)):
        assert [(event.kind, event.name) for event in events] == kinds
        assert [event.time for event in events] == pytest.approx(times, abs=bound)


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("engine", "formulation", "preset", "bound"),
    [
        ("projection", "dependent", "default", 1e-8),
        # half-implicit steps are half a step of speed ahead, 1.6e-4 m
        ("pinocchio", "impulses", "matched", 3e-4),
        ("mujoco", "geoms", "tuned", 3e-4),
        ("exudyn", "spheres", "matched", 3e-5),
    ],
)
def test_a_clamped_servo_pushes_through_a_contact(engine: str, formulation: str, preset: str, bound: float) -> None:
    """A finger at its limit has pushed a ball after 0.02 s as far as two routes say, and tells its effort."""
    plugin = load_engine(engine)
    run = plugin.build(load_scene("flick"), plugin.presets[formulation][preset])
    run.advance(0.02)
    sample = run.sample()
    assert sample.p_WB[1, 0] == pytest.approx(0.07318356288203501, abs=bound)
    assert sample.effort == pytest.approx([0.6], abs=1e-6)


@pytest.mark.drill
def test_first_steps_into_an_impact_are_no_evidence() -> None:
    """A ball a tenth of a millimetre above the floor lands within steps of 9 ms, which say nothing of its start."""
    for height, judged in ((0.0501, False), (0.55, True)):
        scene = load_scene("spinning_bounce", height=height, restitution=0.0)
        assert bool(first_steps(PROJECTION, scene, replace(DEFAULT, dt=9e-3))) == judged
        assert all(line.holds for line in first_steps(PROJECTION, scene, replace(DEFAULT, dt=1e-4)))


@pytest.mark.one_in(3)
@pytest.mark.parametrize("part", [-1e-6, 0.0, 1e-6])
def test_a_graze_of_a_stop_passes_no_stop(part: float) -> None:
    """A throw that ends at its stop comes down again, hit or not, with no more than its impact can change."""
    throw = float(np.sqrt(2 * 9.81 * 0.2)) * (1 + part)
    rail = {"axis": (0.0, 0.0, 1.0), "limits": (-5.0, 0.2), "restitution": 0.5}
    box = Body("box", 1.0, inertia=(1.0, 1.0, 1.0))
    run = PROJECTION.build(
        Mechanism((box,), (Joint("rail", "prismatic", "world", "box", v0=(throw,), **rail),)), replace(DEFAULT, dt=0.01)
    )
    heights = []
    for step in range(1, 31):
        run.advance(0.01 * step)
        heights.append(float(run.sample().p_WB[0, 2]))
    assert max(heights) <= 0.2 + 1e-12
    # Speed of the impact, of which one and a half is lost: 0.3 s of that is below the bound, as it is to be.
    hit = np.sqrt(max(0.0, throw**2 - 2 * 9.81 * 0.2))
    assert heights[-1] == pytest.approx(0.3 * throw - 9.81 * 0.3**2 / 2, abs=2 * hit * 0.3 + 1e-9)


def test_a_graze_within_a_step_is_an_impact() -> None:
    """Spheres that overlap for a millisecond as they pass hit each other, though the step ends with them apart."""
    run = PROJECTION.build(load_scene("two_spheres", passing=0.07999), replace(DEFAULT, dt=0.05))
    run.advance(0.2)
    (impact,) = run.events()
    assert impact.kind == "impact"
    assert impact.time == pytest.approx(0.124832443080, abs=1e-9)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("dt", [0.01, 0.003])
def test_an_impact_takes_an_effort_off_its_limit(dt: float) -> None:
    """A foot that falls with a servo at its limit hits the floor once, and then stands with its whole weight."""
    dropped = Mechanism(
        bodies=(Body("foot", 1.5, inertia=(1.0, 1.0, 1.0)),),
        joints=(Joint("shaft", "prismatic", "world", "foot", axis=(0, 0, 1), q0=(0.2,), v0=(-1.0,)),),
        actuators=(Actuator("servo", "shaft", "velocity", target=0.0, kd=100.0, limit=20.0),),
        geometries=(Geometry("ball", "foot", "sphere", radius=0.1), Geometry("floor", "world", "plane")),
        pairs=(Pair("sole", ("ball", "floor"), friction=0.0),),
        gravity=(0.0, 0.0, -9.81),
    )
    run = PROJECTION.build(dropped, replace(DEFAULT, dt=dt))
    run.advance(0.3)
    assert [event.kind for event in run.events()] == ["impact"]
    assert run.sample().contact_force[0, 2] == pytest.approx(1.5 * 9.81)


@pytest.mark.drill
def test_feet_that_hold_together_share_their_friction() -> None:
    """A sled at rest on a slope stays, though the least share of friction is more than its least loaded foot bears."""
    mechanism = mechanism_of(load_scene("sled_on_slope"))
    turned = (*mechanism.joints[0].q0[:3], np.cos(1.12635), 0.0, 0.0, np.sin(1.12635))
    resting = replace(mechanism.joints[0], q0=turned, v0=(0.0,) * 6)
    run = PROJECTION.build(replace(mechanism, joints=(resting,)), DEFAULT)
    run.advance(0.01)
    assert run.events() == ()
    assert np.abs(run.sample().v_WB).max() < 1e-9


@pytest.mark.nightly
def test_a_foot_that_turns_within_a_step_goes_on() -> None:
    """At the end of a slide a foot may slip backwards after one coarse step: it has not stopped, and all rest soon."""
    run = PROJECTION.build(load_scene("sled_on_slope"), replace(DEFAULT, dt=4e-3))
    run.advance(1.0)
    (true,) = true_values("sled_on_slope")
    assert np.hypot(*(run.sample().p_WB[0, :2] - true["values"]["p_WB"][:2])) < 2e-4
    assert [event.kind for event in run.events()] == ["stick", "rest", "rest"]


@pytest.mark.nightly
def test_a_slip_that_ends_while_it_turns_sticks() -> None:
    """A foot whose slip ends within a fixed step becomes the pivot: it does not circle about zero, step after step."""
    run = PROJECTION.build(load_scene("sled_on_slope"), DEFAULT)
    run.advance(0.79)
    (true,) = true_values("sled_on_slope")
    assert [event.kind for event in run.events()] == ["stick"]
    assert run.events()[0].time == pytest.approx(true["events"][0], abs=1e-4)


@pytest.mark.drill
def test_a_slip_from_rest_begins_in_few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps that adapt do not get ever shorter towards its begin, where friction turns it the more quickly."""
    seen = list[float]()
    rates = ContactMotion._rates
    monkeypatch.setattr(ContactMotion, "_rates", lambda motion, y: seen.append(float(y[-1])) or rates(motion, y))
    scene, slips, end = load_scene("sphere_in_cylinder", speed=4, mu_static=0.15), 0.17666799150977489, 0.2
    run = PROJECTION.build(scene, replace(DEFAULT, integrator="dop853", rtol=1e-8))
    run.advance(end)
    assert [event.kind for event in run.events()] == ["slip"]
    assert run.events()[0].time == pytest.approx(slips, abs=1e-7)
    assert sum(time > slips for time in seen) < 1500  # 9000 if the first direction is that of the velocity
    found = truth_of(mechanism_of(scene), np.array([0.0, end])).record
    np.testing.assert_allclose(run.sample().p_WB, found.p_WB[-1], atol=1e-8)
    np.testing.assert_allclose(run.sample().w_WB, found.w_WB[-1], atol=1e-5)


@pytest.mark.parametrize("angle", [0.3, 0.6, 0.9])
def test_a_fixed_step_that_ends_a_slip_keeps_its_direction(angle: float) -> None:
    """A point that friction stops against a weaker drive passes zero along its slip, at every angle between them."""
    step, drive = 0.01, 0.82 * np.array([np.cos(angle), np.sin(angle), 0.0])
    mode = (Acting("slip", None, (1.0, 0.0, 0.0)),)
    directions, u = SlipDirections(step, np.zeros(1), np.zeros(1), 0.0), np.array([0.2, 0.0, 0.0])
    directions.begin(mode)

    def rate(slip: Array) -> Array:
        return np.asarray(drive - directions.heading(0, touching(slip)))

    for count in range(1000):
        directions.look(count * step, mode, [touching(u)], lambda _: drive)
        k1 = rate(u)
        k2 = rate(u + 0.5 * step * k1)
        k3 = rate(u + 0.5 * step * k2)
        u = u + step / 6 * (k1 + 2 * k2 + 2 * k3 + rate(u + step * k3))
        if directions.passed(0, touching(u)) > 0:
            break
    assert directions.passed(0, touching(u)) > 0
    assert np.linalg.norm(u) < step


def touching(slip: Array) -> Touching:
    """A contact on a floor with this slip [m/s]."""
    up, zero = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    return Touching(gap=0.0, normal=up, place=zero, slide=slip, normal_rate=zero, place_rate=zero)


def test_a_ball_that_hardly_falls_comes_to_rest() -> None:
    """Rebounds from a tenth of a nanometre are few: the last ones are summed, as those of any fall are."""
    scene = load_scene("spinning_bounce", height=0.05 + 1e-10, restitution=0.5)
    run = PROJECTION.build(scene, replace(DEFAULT, dt=2e-3))
    run.advance(0.01)
    impacts = [event.kind for event in run.events()].count("impact")
    assert 1 < impacts < 10


@pytest.mark.nightly
def test_an_impact_leaves_a_distant_contact_closed() -> None:
    """A ball that rests on a slope turned in space feels nothing of another ball's impact, and stays."""
    bodies = tuple(Body(name, 1.0, inertia=(1e-3, 1e-3, 1e-3)) for name in ("resting", "falling"))
    up = (0.36, 0.48, 0.8)
    joints = tuple(
        Joint(f"guide_of_{body.name}", "prismatic", "world", body.name, axis=up, q0=(q,))
        for body, q in zip(bodies, (0.1, 0.13), strict=True)
    )
    scene = Mechanism(
        bodies=bodies,
        joints=joints,
        geometries=(
            Geometry("slope", "world", "plane", normal=up),
            *(Geometry(f"ball_{body.name}", body.name, "sphere", radius=0.1) for body in bodies),
        ),
        pairs=tuple(Pair(body.name, ("slope", f"ball_{body.name}"), friction=0.0) for body in bodies),
        gravity=(-0.36 * 9.81, -0.48 * 9.81, -0.8 * 9.81),
    )
    run = PROJECTION.build(scene, replace(DEFAULT, dt=1e-3))
    run.advance(0.1)
    assert {event.name for event in run.events()} == {"falling"}


@pytest.mark.nightly
def test_a_contact_that_opens_does_not_hit_at_once() -> None:
    """A finger's ball slips, leaves it, and is gone: what the method's error left of overlap there is no impact."""
    run = PROJECTION.build(load_scene("flick"), replace(DEFAULT, dt=2e-3))
    run.advance(0.1)
    assert [(event.kind, event.name) for event in run.events()] == [("slip", "push"), ("lift_off", "push")]


def test_a_ball_that_rolls_across_a_slope_begins_to_slip_down_it() -> None:
    """Friction acts against the slip that begins, however round-off directs the slip at the start."""
    lean, speed, radius, friction = 0.35, 0.2, 0.025, 0.05
    normal = (float(np.sin(lean)), 0.0, float(np.cos(lean)))
    roll = [speed * part / radius for part in (normal[2], 0.0, -normal[0])]
    start = (*(radius * part for part in normal), 1.0, 0.0, 0.0, 0.0)
    free = Joint("free", "free", "world", "ball", q0=start, v0=(0.0, -speed, 0.0, *roll))
    shapes = (Geometry("s", "ball", "sphere", radius=radius), Geometry("wall", "world", "plane", normal=normal))
    pair = Pair("contact", ("s", "wall"), friction)
    ball = Mechanism((Body("ball", 0.5, inertia=(1.25e-4,) * 3),), (free,), geometries=shapes, pairs=(pair,))
    run = PROJECTION.build(Scene("ball", "", (MechanismElement(ball),)), DEFAULT)
    run.advance(0.1)
    pull = 9.81 * (np.sin(lean) - friction * np.cos(lean))
    assert run.sample().v_WB[0] == pytest.approx([0.1 * pull * normal[2], -speed, -0.1 * pull * normal[0]], abs=1e-9)


@pytest.mark.nightly
def test_corners_of_a_face_land_together() -> None:
    """A box that falls from an edge back onto its face comes to rest by one impact of the other two corners."""
    tilt, half = 0.1, np.array([0.2, 0.1, 0.1])
    height = half[0] * np.sin(tilt) + half[2] * np.cos(tilt)
    scene = Mechanism(
        bodies=(Body("box", 2.0, inertia=(0.0133, 0.0333, 0.0333)),),
        joints=(
            Joint("free", "free", "world", "box", q0=(0, 0, height, np.cos(tilt / 2), 0.0, np.sin(tilt / 2), 0.0)),
        ),
        geometries=(Geometry("solid", "box", "box", size=(0.4, 0.2, 0.2)), Geometry("floor", "world", "plane")),
        pairs=(Pair("touch", ("solid", "floor"), friction=0.8),),
        gravity=(0.0, 0.0, -9.81),
    )
    run = PROJECTION.build(scene, replace(DEFAULT, dt=1e-3))
    run.advance(0.3)
    impacts = [event for event in run.events() if event.kind in {"impact", "lift_off"}]
    assert [event.kind for event in impacts] == ["impact", "impact"]
    assert impacts[0].time == impacts[1].time
    sample = run.sample()
    np.testing.assert_allclose([*sample.v_WB[0], *sample.w_WB[0]], 0.0, atol=1e-12)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("height", "error"), [(0.15, Refused), (0.2, Diverged)])
def test_a_cylinder_that_stands_on_its_end_is_refused(height: float, error: type[Exception]) -> None:
    """One point of an edge holds no end that lies flat: projection says so at the start, or where it lands."""
    cylinder = Geometry("can", "can", "cylinder", radius=0.25, length=0.3)
    mechanism = Mechanism(
        (Body("can", 1.0, inertia=(0.025, 0.025, 0.025)),),
        (Joint("free", "free", "world", "can", q0=(0, 0, height, 1, 0, 0, 0), v0=(1, 0, 0, 0, 0, 0)),),
        geometries=(Geometry("floor", "world", "plane"), cylinder),
        pairs=(Pair("stand", ("can", "floor"), friction=0.0),),
    )
    with pytest.raises(error, match="lies flat"):
        PROJECTION.build(Scene("can", "", (MechanismElement(mechanism),)), DEFAULT).advance(0.3)
