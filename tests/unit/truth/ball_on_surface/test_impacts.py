"""Impacts: a ball bounces infinitely often in a finite time, on any wall, and what a landing makes of its spin."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from proofroll.core.dataset import ended_early
from proofroll.core.errors import InputError
from proofroll.core.events import events_of
from proofroll.elements.ball_on_surface.element import scene_with
from proofroll.files.scene_file import load_scene
from proofroll.truth.ball_on_surface.plug_in import truth

G, A = 9.81, 0.025


@settings(max_examples=5, deadline=None)
@given(e=st.floats(0, 0.8), height=st.floats(0.01, 3))
def test_infinitely_many_bounces(e: float, height: float) -> None:
    """The ball rests after √(2h/g) (1 + e)/(1 - e), and is e^2n h high in the middle of each flight before."""
    fall = math.sqrt(2 * height / G)
    rests = fall * (1 + e) / (1 - e)
    crests = [fall * (1 + sum(2 * e**i for i in range(1, n)) + e**n) for n in range(1, 6)] if e > 0.05 else []
    found = truth(load_scene("bouncing_ball", height=height, restitution=e), np.array([0.0, *crests, rests * 1.5]))
    bar = found["gap"].attrs["error_bar"] + 1e-15
    expected = [height, *(height * e ** (2 * n) for n in range(1, len(crests) + 1)), 0.0]
    np.testing.assert_allclose(found["gap"], expected, rtol=0, atol=bar)
    settles = events_of(found)[-1]
    assert settles.kind == "settle"
    assert settles.time_low <= rests <= settles.time_high


@pytest.mark.arithmetic
def test_an_impact_at_the_end_is_not_among_the_events() -> None:
    """An impact at the last sample, to the last digit, is left out by any arithmetic; one clearly before is told."""
    scene, falls = load_scene("bouncing_ball", height=0.1, restitution=0.5), math.sqrt(2 * 0.1 / G)
    told = [len(events_of(truth(scene, np.array([0.0, 2.5 * falls * part])))) for part in (1 - 1e-15, 1, 1 + 1e-15)]
    assert told == [2, 2, 2]
    assert len(events_of(truth(scene, np.array([0.0, 2.5 * falls * (1 + 1e-6)])))) == 3


@pytest.mark.drill
@settings(max_examples=10, deadline=None)
@given(
    e=st.floats(0.05, 0.97),
    height=st.floats(0.001, 3),
    tilt=st.floats(-1, 1),
    radius=st.floats(0.01, 0.3),
    speed=st.floats(-3, 3),
)
@example(e=0.919, height=2.4, tilt=0.985, radius=0.1, speed=0.0)
@example(e=0.959, height=0.451, tilt=-0.28, radius=0.068, speed=-0.714)
def test_the_bracket_of_the_time_of_rest_holds_it(
    e: float, height: float, tilt: float, radius: float, speed: float
) -> None:
    """On any plane, however far the ball goes on it: round-off of places is as large as its last bounces are high."""
    scene = load_scene("bouncing_ball", restitution=e, height=height, tilt=tilt, radius=radius, speed=speed)
    rests = math.sqrt(2 * height / (G * math.cos(tilt))) * (1 + e) / (1 - e)
    (found,) = (event for event in events_of(truth(scene, np.array([0.0, 1.5 * rests]))) if event.kind == "settle")
    assert found.time_low <= rests <= found.time_high
    assert found.time_high - found.time_low < 1e-11 * rests


def test_a_ball_that_does_not_bounce_leaves_its_only_impact_as_one_that_does() -> None:
    """With e = 0 the contact point goes on with -e_t u, slips, and is braked; it was stopped by the impact."""
    scene = load_scene(
        "bouncing_ball", speed=1.0, restitution=0.0, tangential_restitution=0.5, mu_static=0.5, mu_kinetic=0.2
    )
    lands = math.sqrt(2 / G)
    found = truth(scene, np.array([0.0, lands + 1e-9, lands + 0.2]))
    np.testing.assert_allclose(found["slip"][1], 0.5, atol=1e-7)
    brakes = 0.5 / (3.5 * 0.2 * G)  # the contact point is braked by 7/2 μ g
    assert [event.kind for event in events_of(found)] == ["settle", "slip", "stick"]
    assert events_of(found)[-1].time == pytest.approx(lands + brakes, abs=1e-11)
    free = load_scene("bouncing_ball", speed=1.0, restitution=0.0, tangential_restitution=0.5)
    np.testing.assert_allclose(truth(free, np.array([0.0, lands + 1e-9]))["slip"][1], 0.0, atol=1e-7)


def test_an_orientation_is_known_across_impacts() -> None:
    """The spin jumps there, and both routes take it for what it was before: the bar was 4e-4."""
    scene = load_scene("bouncing_ball", asks=("orientation",), speed=1.0, mu_static=0.2, side_spin=5.0)
    assert truth(scene, np.array([0.0, 0.3, 0.7]))["q_WB"].attrs["error_bar"] < 1e-10


@settings(max_examples=10, deadline=None)
@given(
    e=st.floats(0, 1),
    e_t=st.floats(-1, 1),
    k=st.floats(0.1, 1),
    mu=st.floats(0, 2),
    speed=st.floats(-3, 3),
    rim=st.floats(-3, 3),
)
def test_one_impact(e: float, e_t: float, k: float, mu: float, speed: float, rim: float) -> None:
    """Walton's law: the contact point turns to -e_t u where friction suffices, else friction is μ times the blow."""
    down = math.sqrt(2 * G)
    scene = load_scene(
        "bouncing_ball",
        speed=speed,
        back_spin=rim / A,
        restitution=e,
        tangential_restitution=e_t,
        inertia_ratio=k,
        mu_static=mu,
    )
    after = down / G + 1e-4  # the first flight after it, or the slide
    found = truth(scene, np.array([0.0, after]))
    slip = speed + rim
    change = -math.copysign(min(abs(slip) * (1 + e_t) * k / (1 + k), mu * (1 + e) * down), slip)
    if e < 1e-3:
        return  # it may already slide, or roll
    assert float(found["down_rate"][1]) == pytest.approx(speed + change, abs=1e-10)
    assert float(found["omega3"][1]) * A == pytest.approx(rim + change / k, abs=1e-10)


def test_superball_loses_nothing() -> None:
    """With e = e_t = 1 no impact changes the energy, and thrown under a table the ball comes back (Garwin 1969)."""
    scene = load_scene("bouncing_ball", speed=2, back_spin=90, restitution=1, tangential_restitution=1)
    found = truth(scene, np.linspace(0, 4, 41))
    np.testing.assert_allclose(found["energy"], found["energy"][0], rtol=1e-12)
    rates = np.unique(np.round(found["down_rate"], 9))
    assert len(rates) == 2  # the spin and the speed come back at every second impact


@pytest.mark.parametrize("e", [0.0, 0.6])
def test_landing_in_a_lying_cylinder(e: float) -> None:
    """Where the contact has a restitution, a ball that left the wall lands, and goes on to where the energy lets it."""
    scene = load_scene("tilted_cylinder", tilt=math.pi / 2, speed=2.4, mu_static=0.5)
    scene = scene_with(scene, contact=replace(scene.elements[0].contact, restitution=e))  # type: ignore[attr-defined]
    found = truth(scene, np.linspace(0, 2.5, 26))
    kinds = [event.kind for event in events_of(found)]
    assert kinds[:2] == ["slip", "lift_off"]
    assert "settle" in kinds
    assert ("bounce" in kinds) == (e > 0)
    assert found["gamma"].attrs["error_bar"] < 1e-9
    assert float(found["gap"].min()) > -1e-14
    assert np.all(np.diff(found["energy"]) < 1e-12)


def test_coefficients_have_bounds() -> None:
    """A coefficient beyond its bounds gives one line that names it."""
    for name in ("restitution", "tangential_restitution"):
        with pytest.raises(InputError, match=name):
            load_scene("bouncing_ball", **{name: 1.1})


def test_a_spin_that_alternates_for_ever_has_no_limit() -> None:
    """Bounces that each turn the contact point back whole leave no spin that a ball at rest could have: an end."""
    bouncing = {"restitution": 0.5, "tangential_restitution": 1.0, "mu_static": math.inf, "mu_kinetic": math.inf}
    rests = math.sqrt(2 / G) * 3
    spinning = load_scene("bouncing_ball", back_spin=60.0, **bouncing)
    end = ended_early(truth(spinning, np.array([0.0, rests * 1.1])))
    assert end is not None
    assert "so its spin alternates for ever; end the run earlier, take tangential_restitution below" in end[1]
    # Before, or without a spin, with a bound, or where the spin fades, there is a limit.
    truth(spinning, np.array([0.0, rests * 0.9]))
    truth(load_scene("bouncing_ball", **bouncing), np.array([0.0, rests * 1.1]))
    for limited in ({"mu_static": 10.0, "mu_kinetic": 10.0}, {"tangential_restitution": 0.9}):
        found = truth(load_scene("bouncing_ball", back_spin=60.0, **{**bouncing, **limited}), np.array([0.0, 3.0]))
        assert events_of(found)[0].kind == "bounce"


def test_a_start_in_the_air_beside_a_curved_wall() -> None:
    """A ball in the air with a spin of its own does not leave the wall: its bounces are told, by both routes alike."""
    wall = load_scene("tilted_cylinder", radius=0.05, cylinder_radius=0.5, tilt=1.0, mu_static=0.5)
    ball = wall.elements[0]
    scene = scene_with(
        wall,
        contact=replace(ball.contact, restitution=0.5),
        start=replace(ball.start, coordinates=(3.1, 0.0), velocity=(3.0, 0.0), tangential_spin=(0.0, 0.0), gap=0.05),
    )
    found = truth(scene, np.linspace(0.0, 0.6, 4))
    assert "ill_posed" not in found.attrs
    assert [event.kind for event in events_of(found)] == [*["bounce"] * 4, "settle"]


def test_a_slip_after_bounces_begins_where_they_end() -> None:
    """A ball that slips when it has settled begins to slip then, after all its bounces, and not at the last big one."""
    found = truth(
        load_scene("bouncing_ball", speed=20.0, height=0.1, restitution=0.2, mu_static=0.3), np.linspace(0, 1, 5)
    )
    settles, slips = [event for event in events_of(found) if event.kind in ("settle", "slip")]
    assert (settles.kind, slips.kind) == ("settle", "slip")
    rests = math.sqrt(2 * 0.1 / G) * 1.2 / 0.8
    assert settles.time == slips.time
    assert slips.time == pytest.approx(rests, rel=1e-10)  # it was 1e-8 s early


def test_a_truth_in_the_air_without_a_law_of_impacts_ends_at_the_landing() -> None:
    """A ball that starts in the air, and of whose landing nothing is said, has a truth up to the landing."""
    scene = load_scene("bouncing_ball")
    scene = scene_with(scene, contact=replace(scene.elements[0].contact, restitution=None))
    found = truth(scene, np.linspace(0.0, 1.0, 11))
    end = ended_early(found)
    assert end is not None
    assert re.match(r"the ball lands at t = 0.4515236\d+ s; a restitution law would be needed", end[1])
    assert found["time"].to_numpy().tolist() == [0.0, 0.1, 0.2, pytest.approx(0.3), 0.4]
    assert np.all(np.isfinite(found["p_WB"]))


def test_events_at_the_end_of_the_bounces_stand_in_order() -> None:
    """A slip that ends while the last bounces fade does not end before it began."""
    start = {"tilt": 0.219, "height": 0.153, "speed": -0.806, "cross_speed": 0.2, "side_spin": -40.8, "back_spin": 50.3}
    law = {"restitution": 0.228, "tangential_restitution": -0.115, "mu_static": 0.231, "mu_kinetic": 0.192}
    found = events_of(truth(load_scene("bouncing_ball", **start, **law), np.linspace(0.0, 0.4, 5)))
    assert [event.kind for event in found] == ["bounce", "bounce", "settle", "slip", "stick"]
    times = [event.time for event in found]
    assert times == sorted(times)
