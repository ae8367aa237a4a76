"""The projection method under bounded friction: which events, when, what follows them, and the law of friction."""

from __future__ import annotations

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import Diverged, InputError
from proofroll.core.events import events_of
from proofroll.elements.ball_on_surface.element import rolling_ball, scene_with
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll.elements.mechanism.run.contacts.on_wall import slip_velocity
from proofroll.engines.projection.ball import ball_modes
from proofroll.engines.projection.ball.friction import Friction
from proofroll.engines.projection.ball.geometry import Uniform
from proofroll.engines.projection.ball.method import ProjectedBall
from proofroll.engines.projection.ball.orientation import EulerAngles, RotatingFrame
from proofroll.running.recording import record
from proofroll.running.simulation import build, simulate

EULER, FRAME = "projection[formulation=euler]", "projection[formulation=rotating_frame]"
RK4 = "projection[formulation=rotating_frame,preset=default]"
EULER_RK4 = "projection[formulation=euler,preset=default]"
PAPER = {"speed": 4, "rolling_resistance": 5e-4, "mu_static": 0.35}
G, A, TILT = 9.81, 0.025, 0.35


def cylinder(**parameters):
    """The ball in the cylinder."""
    return proofroll.load_scene("sphere_in_cylinder", **parameters)


def plane(**parameters):
    """The ball on the plane."""
    return proofroll.load_scene("inclined_plane", **{"tilt": TILT, "cross_speed": 0, **parameters})


def run(scene, engine, until, **settings):
    """The engine at the time ``until``, reached in one go."""
    built = build(scene, engine, **settings)
    built.advance(until)
    return built


def kinds(engine):
    """The kinds of the events so far."""
    return [event.kind for event in engine.events()]


def times(engine):
    """The times of the events so far."""
    return np.array([event.time for event in engine.events()])


def local(scene, sample):
    """N, friction and slip velocity in components along e2 and e3."""
    frame = rolling_ball(scene).surface.frame(rolling_ball(scene).surface.locate(sample.p_WB))
    slip = slip_velocity(rolling_ball(scene).ball.radius, frame[:, 0], sample.v_WB, sample.w_WB)
    force = frame.T @ sample.force
    return -force[0], force[1:], frame[:, 1:].T @ slip


@pytest.fixture(scope="module")
def paper():
    """The paper's case to 4 s, sampled."""
    return simulate(cylinder(**PAPER), FRAME, until=4, every=0.02)


def test_samples_and_events_say_the_same(paper):
    """A sample sticks exactly if the last event before it was no slip."""
    slip, stick, again = (event.time for event in events_of(paper))
    t = paper.time.to_numpy()
    expected = (t < slip) | ((t >= stick) & (t < again))
    np.testing.assert_array_equal(paper.sticking, expected)


def test_formulations_agree():
    """Euler angles and the rotating frame give the same events and the same path through them."""
    scene = cylinder(speed=4, mu_static=0.15, mu_kinetic=0.13, rolling_resistance=1e-5)
    angles, frame = (run(scene, engine, 0.5) for engine in (EULER, FRAME))
    assert kinds(angles) == kinds(frame) == ["slip", "stick"]
    np.testing.assert_allclose(times(angles), times(frame), rtol=0, atol=1e-10)
    np.testing.assert_allclose(angles.sample().p_WB, frame.sample().p_WB, rtol=0, atol=1e-11)
    np.testing.assert_allclose(angles.sample().force, frame.sample().force, rtol=0, atol=1e-8)


@pytest.mark.parametrize("mu_kinetic", [0.15, 0.14])
def test_size_of_the_start_does_not_matter(monkeypatch, mu_kinetic):
    """Handing a slip's direction over a decade earlier or later moves events and path by round-off only."""
    found = []
    for start in (1e-2, 1e-3, 1e-4):
        monkeypatch.setattr(ball_modes, "START", start)
        engine = run(cylinder(speed=4, mu_static=0.15, mu_kinetic=mu_kinetic), FRAME, 0.5)
        assert kinds(engine) == ["slip", "stick"]
        found.append([*times(engine), *engine.sample().p_WB])
    np.testing.assert_allclose(found[1:], [found[0]] * 2, rtol=0, atol=1e-11)  # measured 1e-12


def test_slaved_direction_is_the_one_that_is_reached(monkeypatch):
    """A slip started early, and integrated from there, reaches the direction that a slaved one has from the start."""
    scene, directions = cylinder(speed=4, mu_static=0.15), []
    for start in (1e-5, 1e-2):
        monkeypatch.setattr(ball_modes, "START", start)
        engine = run(scene, FRAME, 0.1787)  # 2 ms of slip: one is free by now, the other slaved
        directions.append(np.arctan2(*local(scene, engine.sample())[2][::-1]))
        assert isinstance(engine._motion.mode, ball_modes.FreeSlip if start < 1e-3 else ball_modes.SlavedSlip)
    assert directions[0] == pytest.approx(directions[1], abs=1e-7)


def test_jump_of_friction():
    """With μ_k < μ_s the friction drops at once, and the slip grows at (1/m + a²/J)(μ_s - μ_k) N."""
    scene = cylinder(speed=4, mu_static=0.15, mu_kinetic=0.12)
    engine = run(scene, FRAME, 0.1767)
    since = 0.1767 - times(engine)[0]
    N, friction, slip = local(scene, engine.sample())
    assert np.hypot(*friction) / N == pytest.approx(0.12, rel=1e-12)
    ball = rolling_ball(scene).ball
    growth = (1 / ball.mass + A**2 / ball.inertia) * (0.15 - 0.12) * N
    assert np.hypot(*slip) / since == pytest.approx(growth, rel=2e-3)  # it grows further as the needed friction does


def test_crest_within_a_step():
    """A crest of needed friction that leaves the cone for less than one step is seen, and one just below is not."""
    crest = 12 / 7 * G * 0.2 / 4**2  # f = 0, first reached at cos νt = -1
    above, below = (
        run(cylinder(speed=4, mu_static=crest * scale), FRAME, 0.5, rtol=1e-9) for scale in (1 - 1e-6, 1 + 1e-6)
    )
    assert kinds(above) == ["slip", "stick"]
    assert times(above)[0] == pytest.approx(np.pi / np.sqrt(2 / 7) / 20, abs=3e-4)
    assert kinds(below) == []


def test_many_short_slips():
    """With f = 0 and μ little above g c/V0² it slips and sticks in turns, ever more shortly."""
    engine = run(cylinder(speed=4, mu_static=0.125), FRAME, 1.7)
    assert kinds(engine) == ["slip", "stick"] * 5
    durations = np.diff(times(engine))[::2]
    assert np.all(np.diff(durations) < 0)


def test_fixed_step_brackets_events_by_one_step():
    """With rk4 each event lies in a bracket of the grid, one step wide, and the run goes on along the grid."""
    dt = 1e-3
    engine = run(cylinder(speed=4, mu_static=0.15), RK4, 0.75, dt=dt)
    assert kinds(engine) == ["slip", "stick", "slip", "stick"]
    for event in engine.events():
        assert event.time_low <= event.time <= event.time_high
        assert event.time_high - event.time_low == pytest.approx(dt, rel=1e-9)
        assert event.time_low / dt == pytest.approx(round(event.time_low / dt), abs=1e-9)
    assert times(engine) == pytest.approx([0.176667992, 0.412090574, 0.628116731, 0.710311325], abs=1e-7)
    with pytest.raises(InputError, match="dt"):
        engine.advance(0.7505)


def test_order_survives_the_events():
    """Through slip and stick the error of rk4 still falls with the fourth power of the step."""
    scene = cylinder(speed=4, mu_static=0.15, mu_kinetic=0.14)
    exact = run(scene, FRAME, 0.5).sample().p_WB[2]
    errors = [abs(run(scene, RK4, 0.5, dt=dt).sample().p_WB[2] - exact) for dt in (2e-2, 1e-2, 5e-3)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.7), errors
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4, abs=0.7), errors


def test_the_singularity_in_slip():
    """A slipping ball whose body axis turns into the vertical: euler goes on with other axes, or says that it stops."""
    scene = cylinder(speed=4, axial_speed=-4, mu_static=0.05)
    engine = build(scene, EULER_RK4, singularity="stop")
    with pytest.raises(Diverged, match=r"θ reached .* rad .*near the Euler-angle singularity"):
        engine.advance(0.5)
    found, other = run(scene, EULER, 0.06), run(scene, FRAME, 0.06)
    assert kinds(found) == kinds(other)
    assert found.remarks()
    assert not other.remarks()
    np.testing.assert_allclose(found.sample().p_WB, other.sample().p_WB, rtol=0, atol=1e-10)


@pytest.mark.parametrize("engine", [FRAME, RK4])
def test_leaving_the_wall(engine):
    """In a lying cylinder a ball too slow to pass the top slips and leaves the wall where N = 0; the run ends there."""
    scene = cylinder(speed=2.2, mu_static=0.3)
    scene = scene_with(scene, surface=Cylinder("wall", 0.225, 1.5))
    built = build(scene, engine)
    recording = record(built, scene, np.linspace(0, 1, 11))
    assert kinds(built) == ["slip", "lift_off"]
    assert recording.failure is None
    when = "at t = 0.233181 s" if engine == FRAME else "between t = 0.233 s and 0.234 s"
    assert recording.ended == f"the ball leaves the wall {when}, where this run ends: the model does not let go"
    assert [event.kind for event in events_of(recording.dataset)] == ["slip", "lift_off"]
    assert local(scene, built.sample())[0] == pytest.approx(0, abs=1e-9)


def test_slip_that_reverses():
    """A slip that stops where sticking is impossible goes on the other way, without an event."""
    # With f/a = 0.12 a rolling ball would need |F|/N = 0.086 on the level plane.
    scene = plane(tilt=0, speed=-0.167, rolling_resistance=3e-3, mu_static=0.065)
    engine = build(scene, FRAME)
    ds = record(engine, scene, np.linspace(0, 0.34, 18)).dataset
    assert kinds(engine) == ["slip"]
    assert float(ds.slip2.min()) < -0.1
    assert float(ds.slip2.max()) > 1e-3


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("orientation", [EulerAngles, RotatingFrame])
def test_drive_is_the_needed_friction(orientation, seed):
    """Without friction the slip changes at (1/m + a²/J) times the needed friction reversed, in any state."""
    rng = np.random.default_rng(seed)
    scene = cylinder(rolling_resistance=5e-4, mu_static=0.3)
    describe = orientation()
    ball = ProjectedBall(rolling_ball(scene), Uniform(rolling_ball(scene).surface), describe)
    angles = np.array([0.3, 1.2, -0.7])[: describe.size]
    kin = ball.kinematics(np.concatenate([rng.uniform(-2, 2, 2), angles, rng.uniform(-1, 1, 5) * [20, 1, 90, 90, 90]]))
    needed = ball.contact_force(ball.response(kin))[1:]
    m, J = rolling_ball(scene).ball.mass, rolling_ball(scene).ball.inertia
    found = Friction(ball, rolling_ball(scene).contact).drive(kin)
    np.testing.assert_allclose(found, -(1 / m + A**2 / J) * needed, rtol=0, atol=1e-9 * np.max(np.abs(found)))
