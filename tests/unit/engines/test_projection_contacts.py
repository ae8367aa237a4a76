"""Bodies that touch, by the projection method: switches located within a step, at the order of its steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism.contacts.geometry import Geometry, Pair
from proofroll.elements.mechanism.drives import Actuator
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Body
from proofroll.elements.mechanism.sampling import mechanism_of
from proofroll.elements.mechanism.signal import Formula
from proofroll.files.scene_file import load_scene
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


@pytest.mark.parametrize(
    "name", ["sled", "eccentric_sphere", "free_turntable", "rattleback", "tilted_disc", "ladder", "flick"]
)
def test_a_start_is_certified(name: str) -> None:
    """Geometry, friction and first accelerations of every shape are the scene's to round-off, also on what moves."""
    (element,) = load_scene(name).elements
    assert isinstance(element, MechanismElement)
    run = PROJECTION.build(load_scene(name), DEFAULT)
    lines = element.certify(run.built(), run.sample())
    assert [str(line) for line in lines if not line.holds] == []
    told = {line.quantity for line in lines if line.difference is not None}
    assert {
        "gaps",
        "responses of contacts",
        "friction of contacts",
        "acceleration",
    } <= told
    known = ~np.isnan(element.first_press)
    np.testing.assert_allclose(run.sample().contact_force[known], element.first_press[known], atol=1e-8)


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


def test_contacts_beside_other_switches_are_refused() -> None:
    """A stop beside contacts is refused in a line that says what is followed."""
    mechanism = mechanism_of(load_scene("free_turntable"))
    joints = tuple(
        replace(joint, limits=(-1.0, 1.0)) if joint.kind == "revolute" else joint for joint in mechanism.joints
    )
    with pytest.raises(Refused, match="contacts are followed in trees"):
        PROJECTION.build(replace(mechanism, joints=joints), DEFAULT)


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


def test_a_limit_of_an_effort_is_not_stepped_across() -> None:
    """Steps of 0.03 s, one of which an effort's limit splits, follow a cubic and then a parabola of time exactly."""
    joints = (
        Joint("rail", "prismatic", "world", "cart", axis=(1, 0, 0), v0=(1.0,)),
        Joint("shaft", "prismatic", "cart", "foot", axis=(0, 0, 1), q0=(0.1,)),
    )
    dragged = Mechanism(
        bodies=tuple(Body(name, mass, inertia=(1.0, 1.0, 1.0)) for name, mass in (("cart", 0.5), ("foot", 1.5))),
        joints=joints,
        actuators=(Actuator("push", "rail", "torque", target=Formula("20*t"), limit=4.0),),
        geometries=(Geometry("ball", "foot", "sphere", radius=0.1), Geometry("floor", "world", "plane")),
        pairs=(Pair("sole", ("ball", "floor"), friction=0.2),),
        gravity=(0.0, 0.0, -9.81),
    )
    run = PROJECTION.build(dragged, replace(DEFAULT, dt=0.03))
    run.advance(0.24)
    slowed, left = 0.2 * 1.5 * 9.81 / 2, 0.04
    moved = 0.24 - slowed * 0.24**2 / 2 + 10 * (0.2**3 / 6 + 0.2**2 / 2 * left) + 2.0 * left**2 / 2
    assert run.sample().p_WB[0, 0] == pytest.approx(moved, abs=1e-13)


def test_a_graze_within_a_step_is_an_impact() -> None:
    """Spheres that overlap for a millisecond as they pass hit each other, though the step ends with them apart."""
    run = PROJECTION.build(load_scene("two_spheres", passing=0.07999), replace(DEFAULT, dt=0.05))
    run.advance(0.2)
    (impact,) = run.events()
    assert impact.kind == "impact"
    assert impact.time == pytest.approx(0.124832443080, abs=1e-9)


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


def test_feet_that_hold_together_share_their_friction() -> None:
    """A sled at rest on a slope stays, though the least share of friction is more than its least loaded foot bears."""
    mechanism = mechanism_of(load_scene("sled_on_slope"))
    turned = (*mechanism.joints[0].q0[:3], np.cos(1.12635), 0.0, 0.0, np.sin(1.12635))
    resting = replace(mechanism.joints[0], q0=turned, v0=(0.0,) * 6)
    run = PROJECTION.build(replace(mechanism, joints=(resting,)), DEFAULT)
    run.advance(0.01)
    assert run.events() == ()
    assert np.abs(run.sample().v_WB).max() < 1e-9


@pytest.mark.drill
def test_a_foot_that_turns_within_a_step_goes_on() -> None:
    """At the end of a slide a foot may slip backwards after one coarse step: it has not stopped, and all rest soon."""
    run = PROJECTION.build(load_scene("sled_on_slope"), replace(DEFAULT, dt=4e-3))
    run.advance(1.0)
    (true,) = true_values("sled_on_slope")
    assert np.hypot(*(run.sample().p_WB[0, :2] - true["values"]["p_WB"][:2])) < 2e-4
    assert [event.kind for event in run.events()] == ["stick", "rest", "rest"]


def test_a_ball_that_hardly_falls_comes_to_rest() -> None:
    """Rebounds from a tenth of a nanometre are few: the last ones are summed, as those of any fall are."""
    scene = load_scene("spinning_bounce", height=0.05 + 1e-10, restitution=0.5)
    run = PROJECTION.build(scene, replace(DEFAULT, dt=2e-3))
    run.advance(0.01)
    impacts = [event.kind for event in run.events()].count("impact")
    assert 1 < impacts < 10


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
