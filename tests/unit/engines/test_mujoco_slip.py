"""MuJoCo with bounded friction: stick, slip, stick again, fall."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest

from proofroll.core.errors import InputError, Refused
from proofroll.core.events import events_of
from proofroll.core.time_grid import time_grid
from proofroll.elements.ball_on_surface.element import changed, rolling_ball
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll.files.scene_file import load_scene
from proofroll.running.recording import record
from proofroll.running.simulation import build, simulate

CYLINDER, PLANE = "sphere_in_cylinder", "inclined_plane"
TUNED = ["formulation=chart,preset=tuned", "formulation=free,preset=tuned"]
# Blajer's case, friction 0.35 and f = 0.02 a, and others: events [s] and the height at the end [m] from event-driven
# integration of the equations of stick and slip at a tolerance of 1e-12, by two independent methods.
BLAJER = {"mu_static": 0.35, "rolling_resistance": 5e-4}
CASES = {
    "blajer": (BLAJER, 4.0, [1.720183172, 2.00812799, 2.44969538], -2.2976587),
    "kinetic": (BLAJER | {"mu_kinetic": 0.3}, 4.0, [1.720183172, 2.042487748, 2.231797535], -4.3545715),
    "slow": ({"mu_static": 0.35, "speed": 2.0}, 1.0, [0.2166732034], -1.9496990),
    "slow, resisted": (BLAJER | {"speed": 2.0}, 1.0, [0.2072033882], -2.1426200),
    "recovers": ({"mu_static": 0.15}, 1.0, [0.176667992, 0.412090574, 0.628116731, 0.710311323], None),
    "falls": ({"mu_static": 0.12}, 3.0, [0.14413074], -2.7869160),
}


@functools.cache
def run(case: str, engine: str, every: float = 0.01):
    """A run of a case and the scene, made once for all tests."""
    parameters, until, _, _ = CASES[case]
    scene = load_scene(CYLINDER, **parameters)
    recording = record(build(scene, f"mujoco[{engine}]"), scene, time_grid(until, every))
    assert recording.failure is None
    return recording.dataset


def assert_events(case: str, engine: str, within: float) -> None:
    """The events are those of the case in order, each at most ``within`` [s] from its bracket."""
    events = events_of(run(case, engine))
    assert [event.kind for event in events] == [("slip", "stick")[i % 2] for i in range(len(CASES[case][2]))]
    for event, time in zip(events, CASES[case][2], strict=True):
        assert event.time_low - within < time < event.time_high + within


# Bounds are about twice what MuJoCo 4.0 gives, as fractions of a fall of metres: z's error after the last event grows
# with time. Direction of friction is that of the slip at the end of a step, so the order in slip is the first.
@pytest.mark.parametrize(
    ("case", "engine", "bound"),
    [
        ("blajer", "formulation=free,preset=tuned", 2e-4),
        ("kinetic", "formulation=free,preset=tuned", 1e-2),
        ("slow", "formulation=chart,preset=tuned", 5e-5),
        ("slow, resisted", "formulation=free,preset=tuned", 1e-4),
        ("falls", "formulation=chart,preset=tuned", 1e-3),
    ],
)
def test_events_and_fall_with_the_correction(case: str, engine: str, bound: float) -> None:
    """Slip, stick and fall come in the true order, within two steps of their brackets, and end at the true height."""
    assert_events(case, engine, 2e-3)
    assert abs(float(run(case, engine).z[-1]) - CASES[case][3]) < bound


@pytest.mark.parametrize("engine", TUNED)
def test_ball_that_recovers_again_and_again(engine: str) -> None:
    """Without rolling resistance and with enough friction each slip ends, at the true time."""
    assert_events("recovers", engine, 1e-3)


@pytest.mark.parametrize("engine", TUNED)
def test_law_of_friction(engine: str) -> None:
    """Friction is below mu_s N while the ball sticks; while it slips it is mu_k N, against the slip."""
    ds = run("kinetic", engine)
    contact = rolling_ball(load_scene(CYLINDER, **CASES["kinetic"][0])).contact
    sticks = ds.sticking.to_numpy() == 1
    mu = ds.needed_friction.to_numpy()
    assert sticks.any()
    assert not sticks.all()
    assert np.max(mu[sticks]) < contact.mu_static
    np.testing.assert_allclose(mu[~sticks], contact.mu_kinetic, rtol=1e-8)
    slip = np.stack([ds.slip2, ds.slip3])
    speed = np.hypot(*slip)
    fast = ~sticks & (speed > 0.1)  # within 10 steps' acceleration of a standstill, half a step turns it noticeably
    cosine = np.sum(slip * np.stack([ds.F2, ds.F3]), axis=0) / (speed * mu * ds.N.to_numpy())
    assert fast.sum() > 50
    np.testing.assert_allclose(cosine[fast], -1.0, atol=1e-3)


@pytest.mark.parametrize("engine", TUNED)
def test_creep_while_sticking_is_the_depth(engine: str) -> None:
    """While the ball sticks, its contact point moves by no more than the preload's depth makes it: 0.01 % of V."""
    ds = run("blajer", engine)
    slip = np.hypot(ds.slip2, ds.slip3).where(ds.sticking == 1)
    settled = slip.where(ds.time < 1.71)  # right after a slip the damping has still to end it
    assert float(settled.max()) < 4e-4


@pytest.mark.parametrize("engine", TUNED)
def test_contact_does_not_chatter_with_the_correction(engine: str) -> None:
    """The normal force in slip is the one that the path needs, m c γ̇², to half a per cent of the initial one."""
    ds = run("blajer", engine)
    needed = 0.517 * 0.2 * ds.gamma_rate**2
    slips = ds.sticking == 0
    assert float(abs(ds.N - needed).where(slips).max()) < 0.2


def test_pyramid_slips_when_the_sum_of_components_reaches_the_bound() -> None:
    """With the pyramidal cone the ball slips when |F2| + |F3| = mu N, 20 ms before the truth, corrected or not."""
    rolls = simulate(load_scene(CYLINDER, rolling_resistance=5e-4), "mujoco", until=1.72, every=2e-3)
    sums = ((abs(rolls.F2) + abs(rolls.F3)) / rolls.N).to_numpy()
    expected = float(rolls.time[np.argmax(sums > 0.35)])
    assert expected < CASES["blajer"][2][0] - 0.01
    for preset in ("matched", "tuned"):
        engine = build(load_scene(CYLINDER, **BLAJER), f"mujoco[cone=pyramidal,preset={preset}]")
        engine.advance(1.75)
        assert engine.events()[0].time == pytest.approx(expected, abs=5e-3)


@pytest.mark.parametrize("engine", TUNED)
@pytest.mark.parametrize("mu_kinetic", [0.05, 0.02, 0.0])
def test_sliding_down_a_plane_in_closed_form(engine: str, mu_kinetic: float) -> None:
    """On a plane too steep for it the ball slips from the start, faster in proportion to time."""
    scene = load_scene(PLANE, mu_static=0.05, mu_kinetic=mu_kinetic)
    recording = record(build(scene, f"mujoco[{engine}]"), scene, time_grid(0.5, 0.05))
    ds, t = recording.dataset, recording.dataset.time.to_numpy()
    body = rolling_ball(scene)
    along, into = body.gravity @ body.surface.frame(body.u0)[:, 1], body.gravity @ body.surface.frame(body.u0)[:, 0]
    assert [(event.kind, event.time) for event in events_of(ds)] == [("slip", 0.0)]
    assert not ds.sticking.any()
    start = float(ds.down[0])
    path = start + float(ds.down_rate[0]) * t + 0.5 * (along - mu_kinetic * into) * t**2
    # Friction is exact but for the depth of the contact, which shortens its lever.
    np.testing.assert_allclose(ds.down, path, atol=1e-6)
    np.testing.assert_allclose(ds.slip2, (along - 3.5 * mu_kinetic * into) * t, atol=1e-5)
    np.testing.assert_allclose(ds.slip3, 0.0, atol=1e-5)


@pytest.mark.parametrize("engine", [*TUNED, "formulation=chart"])
def test_no_friction_at_all(engine: str) -> None:
    """With mu = 0 the contact has no rows of friction, and the ball falls freely along the axis."""
    scene = load_scene(CYLINDER, mu_static=0.0)
    built = build(scene, f"mujoco[{engine}]")
    assert np.all(built._model.geom_condim == 1)
    ds = record(built, scene, time_grid(0.5, 0.1)).dataset
    np.testing.assert_allclose(ds.z, -0.5 * 9.81 * ds.time**2, atol=1e-10)
    np.testing.assert_allclose(np.stack([ds.F2, ds.F3]), 0.0, atol=1e-12)
    assert not ds.sticking.any()


@pytest.mark.parametrize("engine", ["formulation=chart", "formulation=free", "formulation=free,integrator=RK4"])
def test_bound_that_is_never_reached_changes_nothing(engine: str) -> None:
    """With a bound as large as what stands for unbounded friction the motion is the same to the last bit."""
    unbounded, bounded = ({"rolling_resistance": 5e-4}, {"rolling_resistance": 5e-4, "mu_static": 1e3})
    samples = []
    for parameters in (unbounded, bounded):
        built = build(load_scene(CYLINDER, **parameters), f"mujoco[{engine}]")
        built.advance(0.2)
        samples.append(built.sample())
    for name in ("p_WB", "v_WB", "w_WB", "q_WB", "force"):
        np.testing.assert_array_equal(*(getattr(sample, name) for sample in samples))
    assert [sample.sticking for sample in samples] == [None, True]
    assert built.events() == []


def test_unbounded_friction_is_built_as_before() -> None:
    """Without a bound there is no memory for a slip, no event, and the friction of the settings."""
    for engine in TUNED:
        built = build(load_scene(CYLINDER), f"mujoco[{engine}]")
        assert built._model.nuserdata == 0
        assert np.all(built._model.geom_friction[:, 0] == 1e3)
        assert built.events() == []
        assert built.sample().sticking is None


def test_coefficients_are_the_scenes() -> None:
    """The static coefficient is in the model while the ball sticks, the kinetic one while it slips."""
    scene = load_scene(CYLINDER, **CASES["kinetic"][0])
    built = build(scene, "mujoco[preset=tuned]")
    for until, mu in ((1.7, 0.35), (1.9, 0.3), (2.1, 0.35), (2.3, 0.3)):
        built.advance(until)
        assert np.all(built._model.geom_friction[:, 0] == mu)


@pytest.mark.parametrize("engine", [*TUNED, "formulation=chart", "formulation=chart,cone=pyramidal"])
def test_samples_and_events_agree(engine: str) -> None:
    """Between two samples that differ there is an event, and brackets are one step wide and in order."""
    ds = run("recovers", engine)
    events = events_of(ds)
    times, sticks = ds.time.to_numpy(), ds.sticking.to_numpy()
    for before, after, low, high in zip(sticks, sticks[1:], times, times[1:], strict=False):
        # An event within the step at a sample may be seen on either side of it.
        inside = [event for event in events if low - 1.5e-3 < event.time < high + 1.5e-3]
        assert (before == after) or inside
    for event in events:
        assert event.time_high - event.time_low == pytest.approx(1e-3, rel=1e-9)
    assert all(a.time_high <= b.time_low + 1e-9 and a.kind != b.kind for a, b in itertools.pairwise(events))


@pytest.mark.parametrize("engine", [*TUNED, "formulation=free", "formulation=chart,cone=pyramidal,preset=tuned"])
def test_sampling_and_rebuilding_change_nothing(engine: str) -> None:
    """Through stick and slip, a run that is sampled often ends as a second one that is not, to the last bit."""
    scene = load_scene(CYLINDER, **(CASES["recovers"][0] | {"mu_kinetic": 0.12, "rolling_resistance": 5e-4}))
    often, once = (build(scene, f"mujoco[{engine}]") for _ in range(2))
    for step in range(1, 51):
        often.advance(0.01 * step)
        often.sample()
        often.events()
    once.advance(0.5)
    np.testing.assert_array_equal(often._data.qpos, once._data.qpos)
    np.testing.assert_array_equal(often._data.qvel, once._data.qvel)
    assert often.events() == once.events() != []


@pytest.mark.parametrize("engine", [*TUNED, "formulation=chart", "formulation=free", "formulation=free,preset=default"])
def test_flight_is_one_lift_off(engine: str) -> None:
    """A ball that falls off a leaning wall has one lift-off, no stick or slip in the air, and events after it lands."""
    scene = load_scene(CYLINDER, mu_static=0.8, speed=2.0)
    leaning = changed(scene, surface=Cylinder("wall", scene.elements[0].surface.radius, tilt=1.2))
    true = events_of(simulate(leaning, "truth", until=0.3, every=0.05))
    assert [event.kind for event in true] == ["slip", "lift_off"]
    ds = record(build(leaning, f"mujoco[{engine}]"), leaning, time_grid(0.6, 0.01)).dataset
    events = events_of(ds)
    left = [event for event in events if event.kind == "lift_off"]
    assert len(left) == 1
    # What MuJoCo's cone lifts leaves early, and what its default contact lets sink leaves late.
    assert left[0].time == pytest.approx(true[1].time, abs=2e-3 if engine in TUNED else 2.5e-2)
    assert not [event for event in events if left[0].time < event.time < 0.5]
    assert [event.kind for event in events if event.time > 0.5][:1] == ["stick"]
    assert not ds.sticking.where((ds.time > 0.28) & (ds.time < 0.5), drop=True).any()


def test_hops_are_not_lift_offs() -> None:
    """A contact that chatters slips all the while it does, 25 steps at a time without a force: nothing else is told."""
    for engine in ("formulation=chart", "formulation=free"):
        ds = run("blajer", engine)
        # After 3.7 s the free ball is thrown 40 mm off the wall, more than its radius: those are flights.
        before = [event for event in events_of(ds) if event.time < 3.0]
        assert "lift_off" not in {event.kind for event in before}
        assert before[-1].kind == "slip"
        assert before[-1].time < 2.5
        assert float(ds.N.where((ds.time > 2.5) & (ds.time < 3.0)).min()) == 0.0


def test_damping_of_the_slip_with_bounded_friction() -> None:
    """With a contact pair the coefficients are switched in the pair, and events and fall are those of the truth."""
    engine = "formulation=free,cone_correction=true,friction_damping=1.9"
    assert_events("kinetic", engine, 1e-2)
    built = build(load_scene(CYLINDER, **CASES["kinetic"][0]), f"mujoco[{engine}]")
    for until, mu in ((1.7, 0.35), (1.9, 0.3)):
        built.advance(until)
        assert built._evaluated().contact[0].friction[0] == mu


@pytest.mark.parametrize("engine", TUNED)
def test_ball_that_rolls_to_rest(engine: str) -> None:
    """On a level plane rolling resistance stops the ball; where V vanishes nothing is divided by it."""
    scene = load_scene(PLANE, tilt=0.0, speed=0.05, cross_speed=0.0, normal_spin=0.0, **BLAJER)
    ds = record(build(scene, f"mujoco[{engine}]"), scene, time_grid(1.0, 0.1)).dataset
    assert ds.sizes["time"] == 11
    assert float(abs(ds.down_rate[-1])) < 2e-3
    assert ds.sticking.all()


@pytest.mark.parametrize(
    ("engine", "parameters", "reason"),
    [
        ("formulation=facets", {"mu_static": 0.35}, "facets"),
        ("formulation=chart", {"mu_static": 1e-6}, "1e-05"),
        ("formulation=chart", {"mu_static": 0.3, "mu_kinetic": 1e-6}, "1e-05"),
        ("formulation=chart,cone=pyramidal", {"mu_static": 1.5}, "elliptic"),
    ],
)
def test_what_mujoco_cannot_represent_is_refused(engine: str, parameters: dict[str, float], reason: str) -> None:
    """Coefficients that MuJoCo would change without a word, and a wall without a slip, are refused with the reason."""
    with pytest.raises(Refused, match=reason):
        build(load_scene(CYLINDER, **parameters), f"mujoco[{engine}]")


@pytest.mark.parametrize(
    ("engine", "parameters", "field"),
    [
        ("formulation=facets,cone_correction=true", {}, "cone_correction"),
        ("formulation=free,cone_correction=true,integrator=RK4", {"mu_static": 0.35}, "integrator"),
        ("formulation=free,preset=tuned,cone=pyramidal", {"mu_static": 0.35}, "cone"),
    ],
)
def test_wrong_settings_give_one_clear_line(engine: str, parameters: dict[str, float], field: str) -> None:
    """Settings that MuJoCo would ignore or misread are refused by name before anything is built."""
    with pytest.raises(InputError) as caught:
        build(load_scene(CYLINDER, **parameters), f"mujoco[{engine}]")
    assert field in caught.value.field
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("engine", TUNED)
@pytest.mark.parametrize("setting", ["dt=1e-2", "time_constant=20"])
def test_a_start_that_slips_is_loaded_from_the_first_sample(engine: str, setting: str) -> None:
    """However soft the contact, a ball that slips from the start presses on the wall as the truth says, at once."""
    found, true = (simulate("slide_to_roll", name, until=0.02) for name in (f"mujoco[{engine},{setting}]", "truth"))
    np.testing.assert_allclose(found.N, true.N, rtol=1e-8)
