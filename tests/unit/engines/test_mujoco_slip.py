"""MuJoCo with bounded friction: stick, slip, stick again, fall."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from slip_cases import CASES, PAPER, run
from true_runs import true_run

from proofroll.core.errors import Refused
from proofroll.core.events import events_of
from proofroll.core.time_grid import time_grid
from proofroll.elements.ball_on_surface.element import scene_with
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll.files.scene_file import load_scene
from proofroll.running.recording import record
from proofroll.running.simulation import build, simulate

CYLINDER, PLANE = "sphere_in_cylinder", "inclined_plane"
TUNED = ["formulation=chart,preset=tuned", "formulation=free,preset=tuned"]


@pytest.mark.parametrize("engine", TUNED)
def test_contact_does_not_chatter_with_the_correction(engine: str) -> None:
    """The normal force in slip is the one that the path needs, m c γ̇², to half a per cent of the initial one."""
    ds = run("paper", f"mujoco[{engine}]", 2.1, 0.01)
    needed = 0.517 * 0.2 * ds.gamma_rate**2
    slips = ds.sticking == 0
    assert 20 < slips.sum() < 40
    assert float(abs(ds.N - needed).where(slips).max()) < 0.2


def test_pyramid_slips_when_the_sum_of_components_reaches_the_bound() -> None:
    """With the pyramidal cone the ball slips when |F2| + |F3| = mu N, 20 ms before the truth, corrected or not."""
    rolls = simulate(load_scene(CYLINDER, rolling_resistance=5e-4), "mujoco", until=1.72, every=2e-3)
    sums = ((abs(rolls.F2) + abs(rolls.F3)) / rolls.N).to_numpy()
    expected = float(rolls.time[np.argmax(sums > 0.35)])
    assert expected < CASES["paper"][2][0] - 0.01
    for preset in ("matched", "tuned"):
        engine = build(load_scene(CYLINDER, **PAPER), f"mujoco[cone=pyramidal,preset={preset}]")
        engine.advance(1.75)
        assert engine.events()[0].time == pytest.approx(expected, abs=5e-3)


def test_unbounded_friction_is_built_as_before() -> None:
    """Without a bound there is no memory for a slip, no event, and the friction of the settings."""
    for engine in TUNED:
        built = build(load_scene(CYLINDER), f"mujoco[{engine}]")
        assert built._model.nuserdata == 0
        assert np.all(built._model.geom_friction[:, 0] == 1e3)
        assert built.events() == []
        assert built.sample().sticking is None


def test_coefficients_are_the_scenes() -> None:
    """The static coefficient is in the model while the ball sticks, the kinetic one while it slips; 0 has no rows."""
    assert np.all(build(load_scene(CYLINDER, mu_static=0.0), "mujoco")._model.geom_condim == 1)
    scene = load_scene(CYLINDER, **CASES["kinetic"][0])
    built = build(scene, "mujoco[preset=tuned]")
    for until, mu in ((1.7, 0.35), (1.9, 0.3), (2.1, 0.35), (2.3, 0.3)):
        built.advance(until)
        assert np.all(built._model.geom_friction[:, 0] == mu)


@pytest.mark.parametrize("engine", [*TUNED, "formulation=chart", "formulation=chart,cone=pyramidal"])
def test_samples_and_events_agree(engine: str) -> None:
    """Between two samples that differ there is an event, and brackets are one step wide and in order."""
    ds = run("recovers", f"mujoco[{engine}]", 1.0, 0.01)
    events = events_of(ds)
    times, sticks = ds.time.to_numpy(), ds.sticking.to_numpy()
    for before, after, low, high in zip(sticks, sticks[1:], times, times[1:], strict=False):
        # An event within the step at a sample may be seen on either side of it.
        inside = [event for event in events if low - 1.5e-3 < event.time < high + 1.5e-3]
        assert (before == after) or inside
    for event in events:
        assert event.time_high - event.time_low == pytest.approx(1e-3, rel=1e-9)
    assert all(a.time_high <= b.time_low + 1e-9 and a.kind != b.kind for a, b in itertools.pairwise(events))


@pytest.mark.parametrize("engine", [*TUNED, "formulation=chart", "formulation=free", "formulation=free,preset=default"])
def test_flight_is_one_lift_off(engine: str) -> None:
    """A ball that falls off a leaning wall has one lift-off, no stick or slip in the air, and events after it lands."""
    scene = load_scene(CYLINDER, mu_static=0.8, speed=2.0)
    leaning = scene_with(scene, surface=Cylinder("wall", scene.elements[0].surface.radius, tilt=1.2))
    true = events_of(true_run(leaning, 0.3, 0.05))
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
        # Longer, and the free ball is thrown 40 mm off the wall, more than its radius: those are flights.
        ds = run("paper", f"mujoco[{engine}]", 3.0, 0.01)
        before = events_of(ds)
        assert "lift_off" not in {event.kind for event in before}
        assert before[-1].kind == "slip"
        assert before[-1].time < 2.5
        assert float(ds.N.where((ds.time > 2.5) & (ds.time < 3.0)).min()) == 0.0


def test_damping_of_the_slip_with_bounded_friction() -> None:
    """With a contact pair the coefficients are switched in the pair."""
    engine = "formulation=free,cone_correction=true,friction_damping=1.9"
    built = build(load_scene(CYLINDER, **CASES["kinetic"][0]), f"mujoco[{engine}]")
    for until, mu in ((1.7, 0.35), (1.9, 0.3)):
        built.advance(until)
        assert built._evaluated().contact[0].friction[0] == mu


@pytest.mark.parametrize("engine", TUNED)
def test_ball_that_rolls_to_rest(engine: str) -> None:
    """On a level plane rolling resistance stops the ball; where V vanishes nothing is divided by it."""
    scene = load_scene(PLANE, tilt=0.0, speed=0.05, cross_speed=0.0, normal_spin=0.0, **PAPER)
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
