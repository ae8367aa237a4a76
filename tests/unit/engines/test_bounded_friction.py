"""Stick and slip in every engine that bounds friction: when, by which law, and what a bound leaves alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slip_cases import CASES, run

from proofroll.core.certificate import certify
from proofroll.core.events import events_of
from proofroll.core.time_grid import time_grid
from proofroll.files.scene_file import load_scene
from proofroll.running.recording import record
from proofroll.running.simulation import build

GENERIC, CONTACT = (f"exudyn[formulation={name},dt=1e-3]" for name in ("generic", "contact"))
CHART, FREE = (f"mujoco[formulation={name},preset=tuned]" for name in ("chart", "free"))
COMPOSITE, FLYER = (f"pinocchio[formulation={name},preset=tuned]" for name in ("composite", "free_flyer"))
PGS, ADMM = (f"pinocchio[formulation=contact,solver={name}]" for name in ("pgs", "admm"))
FRAME = "projection[formulation=rotating_frame]"


def need(engine: str) -> None:
    """Skips the test where the package of an engine that is not ours is not installed."""
    if not engine.startswith("projection"):
        pytest.importorskip(engine.partition("[")[0])


# Engine, and how far its events [s] and its height at the end [m] may be off; of Exudyn and MuJoCo twice what was
# measured, of the others the digits of the reference. MuJoCo's events lie in brackets of a step of 1e-3 s. Exudyn's
# generic falls as dt², its contact is first limited by its stiffness and by its friction zone.
@pytest.mark.parametrize(
    ("case", "engine", "late", "off"),
    [
        ("paper", "exudyn[formulation=generic,preset=default]", 4e-5, 2e-5),
        ("paper", "exudyn[formulation=contact,preset=default]", 5e-3, 1.6e-2),
        ("kinetic", FREE, 2.5e-3, 1e-2),
        ("kinetic", "mujoco[formulation=free,cone_correction=true,friction_damping=1.9]", 1.05e-2, None),
        ("drops", GENERIC, 1e-4, None),
        ("drops", COMPOSITE, 5e-8, None),
        ("slow", CHART, 2.5e-3, 5e-5),
        ("slow, resisted", GENERIC, 1e-4, None),
        ("slow, resisted", FREE, 2.5e-3, 1e-4),
        ("slow, resisted", COMPOSITE, 5e-8, None),
        ("slow, resisted", FRAME, 4e-8, None),
        ("recovers", GENERIC, 1e-4, None),
        ("recovers", CHART, 1.5e-3, None),
        ("recovers", FREE, 1.5e-3, None),
        ("recovers", FRAME, 6e-9, None),
        ("falls", CHART, 2.5e-3, 1e-3),
        ("holds", COMPOSITE, 0.0, None),
    ],
)
def test_events_and_fall(case: str, engine: str, late: float, off: float | None) -> None:
    """Slip, stick and fall come in turn, when they must, each within its bracket, and end at the true height.

    Of the paper's case are here the settings that are no rows of the comparison ``stick_slip``.
    """
    need(engine)
    _, until, times, height = CASES[case]
    found = run(case, engine, until, 0.05)
    events = events_of(found)
    assert [event.kind for event in events] == [("slip", "stick")[number % 2] for number in range(len(times))]
    wide = 1e-8 if engine in {COMPOSITE, FRAME} else 1.001e-3
    assert all(event.time_low <= event.time <= event.time_high <= event.time_low + wide for event in events)
    # Tight, for how late an event is comes from the method at its step; processors change it by round-off.
    np.testing.assert_allclose([event.time for event in events], times, rtol=0, atol=late)
    if off is not None:
        assert float(found.z[-1]) == pytest.approx(height, abs=off)


# What is left of |F| = μk N [-], of the slip beside the friction [m/s], and of the slip while the ball sticks [m/s]; of
# Exudyn and MuJoCo twice what was measured. Exudyn's generic takes the direction of the slip that it predicts for the
# end of a step, and MuJoCo that of half a step; the contact points of its contact and of MuJoCo lie midway in a depth.
@pytest.mark.parametrize(
    ("case", "engine", "every", "law", "beside", "creep"),
    [
        ("drops", GENERIC, 1e-3, 1e-12, 1.5e-5, 1e-12),
        ("paper", CONTACT, 1e-3, 1e-3, 8e-4, 1.1e-3),
        ("paper", FRAME, 1e-2, 1e-12, 1e-12, 1e-13),
        ("kinetic", COMPOSITE, 1e-2, 1e-12, 1e-12, 1e-12),
        ("paper", ADMM, 1e-2, 1e-8, 3e-5, 2e-6),
        ("kinetic", PGS, 1e-2, 1e-12, 1.4e-4, 2e-6),
        ("kinetic", CHART, 1e-2, 1e-8, 4e-4, 4e-4),
        ("kinetic", FREE, 1e-2, 1e-8, 1.6e-3, 4e-4),
    ],
)
def test_law_of_friction(case: str, engine: str, every: float, law: float, beside: float, creep: float) -> None:
    """In slip |F| = μk N, against the slip velocity; in stick |F| < μs N, and the contact point stays.

    Pinocchio's free flyer is held against the joints of the composite in ``test_pinocchio_slip``.
    """
    need(engine)
    found = run(case, engine, 2.1, every)
    static = CASES[case][0]["mu_static"]
    kinetic = CASES[case][0].get("mu_kinetic", static)
    slips = (found.sticking == 0).to_numpy()
    assert 0.27 < slips.sum() * every < 0.38
    slip, friction = np.hypot(found.slip2, found.slip3), np.hypot(found.F2, found.F3)
    across = np.abs(found.F2 * found.slip3 - found.F3 * found.slip2) / friction
    np.testing.assert_allclose((friction / found.N)[slips], kinetic, rtol=law)
    assert float((found.F2 * found.slip2 + found.F3 * found.slip3)[slips].max()) < 0
    assert float(across[slips].max()) < beside
    assert float(found.needed_friction[~slips].max()) <= static
    assert float(slip[~slips].max()) < creep


# Engine, kinetic coefficients, speed across the slope [m/s], and what is left of the way [m] and of the slip [m/s].
# Exudyn's contact has one coefficient. The depth of MuJoCo's shortens the lever of friction.
@pytest.mark.parametrize(
    ("engine", "kinetic", "across", "way", "slip"),
    [
        (GENERIC, (0.05, 0.02, 0.0), 0.2, 1e-12, 5e-12),
        (CONTACT, (0.05,), 0.2, 2e-4, 1e-3),
        (CHART, (0.05, 0.02, 0.0), 0.2, 1e-6, 1e-5),
        (FREE, (0.05, 0.02, 0.0), 0.2, 1e-6, 1e-5),
        (COMPOSITE, (0.05, 0.02, 0.0), 0.0, 1e-9, 1e-9),
        (FLYER, (0.05, 0.02), 0.0, 1e-9, 1e-9),
        ("pinocchio[preset=default]", (0.05, 0.02), 0.0, 1e-9, 1e-9),
        ("pinocchio[formulation=contact]", (0.05, 0.02, 0.0), 0.0, 1e-9, 1e-9),
        (FRAME, (0.05, 0.02, 0.0), 0.0, 1e-13, 1e-13),
    ],
)
def test_slope_too_steep_to_roll(
    engine: str, kinetic: tuple[float, ...], across: float, way: float, slip: float
) -> None:
    """Where tan α > 7μ/2 the ball slips from the start, faster in proportion to the time; closed form."""
    need(engine)
    for mu in kinetic:
        scene = load_scene("inclined_plane", tilt=0.35, cross_speed=across, mu_static=0.05, mu_kinetic=mu)
        built = build(scene, engine)
        assert [line.quantity for line in certify(built, scene) if not line.holds] == []
        found = record(built, scene, time_grid(0.5, 0.1)).dataset
        assert [(event.kind, event.time) for event in events_of(found)] == [("slip", 0.0)]
        assert not found.sticking.any()
        t, pull, press = found.time.to_numpy(), 9.81 * math.sin(0.35), 9.81 * math.cos(0.35)
        # u̇ = g sin α - (7/2) μ g cos α; the force does not turn, as the slip has the direction of the slope.
        np.testing.assert_allclose(found.down, 0.5 * t + (pull - mu * press) * t**2 / 2, rtol=0, atol=way)
        np.testing.assert_allclose(found.across, across * t, rtol=0, atol=way)
        np.testing.assert_allclose(found.slip2, (pull - 3.5 * mu * press) * t, rtol=0, atol=slip)
        np.testing.assert_allclose(found.slip3, 0.0, rtol=0, atol=slip)
        np.testing.assert_allclose(found.F2, -mu * 0.517 * press, rtol=0, atol=max(slip, 1e-12))


@pytest.mark.parametrize(
    ("engine", "spare"), [(GENERIC, 5e-2), (CONTACT, 5e-2), (FREE, 5e-2), (COMPOSITE, 1e-9), (FRAME, 1e-9)]
)
def test_slope_flat_enough_to_roll(engine: str, spare: float) -> None:
    """Where tan α < 7μ/2, however little, the ball rolls as with unbounded friction."""
    need(engine)
    scene = load_scene("inclined_plane", tilt=0.35, mu_static=math.tan(0.35) / 3.5 * (1 + spare))
    found = record(build(scene, engine), scene, time_grid(0.3, 0.1)).dataset
    assert events_of(found) == []
    assert found.sticking.all()
    assert float(found.down[-1]) == pytest.approx(0.5 * 0.3 + 5 / 7 * 9.81 * math.sin(0.35) * 0.09 / 2, abs=1e-4)


# Engine, and what is left of the fall [m] and of the speed across it [-]. Of the 41 N of Exudyn's contact the tolerance
# of Newton's method leaves 1e-7 along the axis; a ball in MuJoCo's starts in a depth; of Pinocchio's it is twice what
# was measured at its step of 1e-3 s.
@pytest.mark.parametrize(
    ("engine", "fall", "speed"),
    [
        (GENERIC, 1e-9, 1e-9),
        (CONTACT, 1e-6, 1e-6),
        (CHART, 1e-10, 2e-7),
        (FREE, 1e-10, 2e-7),
        ("mujoco", 1e-10, 2e-7),
        (COMPOSITE, 1e-9, 1e-9),
        (FLYER, 1e-9, 1e-9),
        ("pinocchio[preset=default]", 1e-9, 1e-9),
        (PGS, 1e-9, 4e-8),
        (FRAME, 1e-12, 1e-12),
    ],
)
def test_no_friction(engine: str, fall: float, speed: float) -> None:
    """With μ = 0 the ball falls freely along the cylinder, and keeps its spin."""
    need(engine)
    scene = load_scene("sphere_in_cylinder", mu_static=0.0)
    found = record(build(scene, engine), scene, time_grid(0.5, 0.1)).dataset
    np.testing.assert_allclose(found.z, -9.81 * found.time**2 / 2, rtol=fall, atol=fall)
    np.testing.assert_allclose(np.hypot(found.v_WB[:, 0], found.v_WB[:, 1]), 4.0, rtol=speed)
    np.testing.assert_allclose(np.stack([found.F2, found.F3]), 0.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.omega3, found.omega3[0], rtol=1e-9)
    assert not found.sticking.any()


@pytest.mark.parametrize(
    ("engine", "accuracy"),
    [
        (GENERIC, 0.0),
        ("mujoco[formulation=chart]", 0.0),
        ("mujoco[formulation=free]", 0.0),
        ("mujoco[formulation=free,integrator=RK4]", 0.0),
        (COMPOSITE, 1e-13),
    ],
)
def test_bound_that_is_never_reached_changes_nothing(engine: str, accuracy: float) -> None:
    """With a bound as large as what may stand for none the motion is the same, and the ball is told to stick."""
    need(engine)
    samples = []
    for mu in (math.inf, 1e3):
        built = build(load_scene("sphere_in_cylinder", rolling_resistance=5e-4, mu_static=mu), engine)
        built.advance(0.3)
        samples.append(built.sample())
        assert list(built.events()) == []
    for name in ("p_WB", "v_WB", "w_WB", "q_WB", "force"):
        unbounded, bounded = (getattr(sample, name) for sample in samples)
        assert (unbounded is None) == (bounded is None)
        if unbounded is not None:
            np.testing.assert_allclose(bounded, unbounded, rtol=accuracy, atol=accuracy)
    assert [sample.sticking for sample in samples] == [None, True]


# With kinetic friction below the static one, but for Exudyn's contact. How far a run in one go may be from one in
# parts [m]: Exudyn's contact halves steps, and a sample brings it back to whole ones; None: steps adapt to the parts.
@pytest.mark.parametrize(
    ("engine", "apart"),
    [
        (GENERIC, 1e-9),
        (CONTACT, 1e-4),
        (CHART, 0.0),
        (FREE, 0.0),
        (COMPOSITE, None),
        ("pinocchio[preset=default]", None),
        ("pinocchio[formulation=contact,solver=admm]", None),
        (FRAME, None),
        ("projection[formulation=rotating_frame,preset=default]", None),
    ],
)
def test_looking_changes_nothing(engine: str, apart: float | None) -> None:
    """Through stick and slip, a run that is looked at often ends as one that is not, to the last bit."""
    need(engine)
    kinetic = 0.15 if engine == CONTACT else 0.12
    scene = load_scene("sphere_in_cylinder", mu_static=0.15, mu_kinetic=kinetic, rolling_resistance=5e-4)
    watched, alone, once = (build(scene, engine) for _ in range(3))
    for step in range(1, 16):
        watched.advance(0.03 * step)
        alone.advance(0.03 * step)
        for look in (watched.sample, watched.events, watched.built):
            look()
    assert list(watched.events()) == list(alone.events()) != []
    for name in ("p_WB", "v_WB", "w_WB", "force"):
        np.testing.assert_array_equal(getattr(watched.sample(), name), getattr(alone.sample(), name))
    if apart is not None:
        once.advance(0.45)
        np.testing.assert_allclose(once.sample().p_WB, alone.sample().p_WB, rtol=0, atol=apart)
        assert [event.kind for event in once.events()] == [event.kind for event in alone.events()]
