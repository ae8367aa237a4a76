"""Impacts: a ball bounces infinitely often in a finite time, on any wall, and what a landing makes of its spin."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proofroll.core.errors import InputError
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene

G, A = 9.81, 0.025


def changed(folder: Path, texts: dict[str, str], **parameters: float) -> Scene:
    """The scene of a tilted cylinder with other texts in its file."""
    text = (data_folder("models") / "tilted_cylinder" / "scene.toml").read_text(encoding="utf-8")
    for old, new in texts.items():
        text = text.replace(old, new)
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return load_scene(str(folder), **parameters)


@pytest.mark.nightly
@settings(max_examples=5, deadline=None)
@given(e=st.just(0.0) | st.floats(0.01, 0.8), height=st.floats(0.01, 3))
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
    assert settles.kind == ("settle" if e else "impact")
    assert settles.time_low <= rests <= settles.time_high


@pytest.mark.nightly
@pytest.mark.arithmetic
def test_an_impact_at_the_end_is_not_among_the_events() -> None:
    """An impact at the last sample, to the last digit, is left out by any arithmetic; one clearly before is told."""
    scene, falls = load_scene("bouncing_ball", height=0.1, restitution=0.5), math.sqrt(2 * 0.1 / G)
    told = [len(events_of(truth(scene, np.array([0.0, 2.5 * falls * part])))) for part in (1 - 1e-15, 1, 1 + 1e-15)]
    assert told == [2, 2, 2]
    assert len(events_of(truth(scene, np.array([0.0, 2.5 * falls * (1 + 1e-6)])))) == 3


@pytest.mark.nightly_of("0.5-2.4-0.985-0.1-0.0")
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("e", "height", "tilt", "radius", "speed"), [(0.5, 2.4, 0.985, 0.1, 0.0), (0.6, 0.451, -0.28, 0.068, -0.714)]
)
def test_the_bracket_of_the_time_of_rest_holds_it(
    e: float, height: float, tilt: float, radius: float, speed: float
) -> None:
    """On any plane, however far the ball goes on it: round-off of places is as large as its last bounces are high."""
    scene = load_scene("bouncing_ball", restitution=e, height=height, tilt=tilt, radius=radius, speed=speed)
    rests = math.sqrt(2 * height / (G * math.cos(tilt))) * (1 + e) / (1 - e)
    (found,) = (event for event in events_of(truth(scene, np.array([0.0, 1.5 * rests]))) if event.kind == "settle")
    assert found.time_low <= rests <= found.time_high
    assert found.time_high - found.time_low < 1e-7 * rests


@pytest.mark.drill
def test_a_ball_that_does_not_bounce_leaves_its_only_impact_as_one_that_does() -> None:
    """With e = 0 the contact point goes on with -e_t u, slips, and is braked."""
    scene = load_scene(
        "bouncing_ball", speed=1.0, restitution=0.0, tangential_restitution=0.5, mu_static=0.5, mu_kinetic=0.2
    )
    lands = math.sqrt(2 / G)
    found = truth(scene, np.array([0.0, lands + 1e-9, lands + 0.2]))
    np.testing.assert_allclose(found["slip"][1], 0.5, atol=1e-7)
    brakes = 0.5 / (3.5 * 0.2 * G)  # the contact point is braked by 7/2 μ g
    assert [event.kind for event in events_of(found)] == ["impact", "stick"]
    assert events_of(found)[-1].time == pytest.approx(lands + brakes, abs=1e-11)


def test_a_slip_that_unbounded_friction_would_stop_at_once_ends_the_truth() -> None:
    """After an impact without rebound the two laws contradict each other; the truth keeps all before it and says so."""
    scene = load_scene("bouncing_ball", speed=1.0, restitution=0.0, tangential_restitution=0.5)
    found = truth(scene, np.array([0.0, 0.3, 1.0]))
    assert found.attrs["ends"] == pytest.approx(math.sqrt(2 / G), abs=1e-12)
    assert "contradict each other" in found.attrs["ended"]
    assert np.isfinite(found["p_WB"][1]).all()


@pytest.mark.drill
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


@pytest.mark.nightly
def test_superball_loses_nothing() -> None:
    """With e = e_t = 1 no impact changes the energy, and thrown under a table the ball comes back (Garwin 1969)."""
    scene = load_scene("bouncing_ball", speed=2, back_spin=90, restitution=1, tangential_restitution=1)
    found = truth(scene, np.linspace(0, 4, 41))
    np.testing.assert_allclose(found["energy"], found["energy"][0], rtol=1e-12)
    rates = np.unique(np.round(found["down_rate"], 9))
    assert len(rates) == 2  # the spin and the speed come back at every second impact


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("e", [0.0, 0.6])
def test_landing_in_a_lying_cylinder(e: float, tmp_path: Path) -> None:
    """Where the contact has a restitution, a ball that left the wall lands, and goes on to where the energy lets it."""
    contact = f"[[contacts]]\nrestitution = {e}"
    scene = changed(tmp_path, {"[[contacts]]": contact}, tilt=math.pi / 2, speed=2.4, mu_static=0.5)
    found = truth(scene, np.linspace(0, 2.5, 26))
    kinds = [event.kind for event in events_of(found)]
    assert kinds[:2] == ["slip", "lift_off"]
    assert "impact" in kinds
    assert ("settle" in kinds) == (e > 0)
    assert found["gamma"].attrs["error_bar"] < 1e-9
    assert float(found["gap"].min()) > -1e-14
    assert np.all(np.diff(found["energy"]) < 1e-12)


def test_coefficients_have_bounds() -> None:
    """A coefficient beyond its bounds gives one line that names it."""
    for name in ("restitution", "tangential_restitution"):
        with pytest.raises(InputError, match=name):
            load_scene("bouncing_ball", **{name: 1.1})


@pytest.mark.nightly
def test_a_start_in_the_air_beside_a_curved_wall(tmp_path: Path) -> None:
    """A ball in the air with a spin of its own does not leave the wall: its bounces are told, by both routes alike."""
    air = {
        "[[contacts]]": "[[contacts]]\nrestitution = 0.5",
        "coordinates = [0, 0]": "coordinates = [3.1, 0]\ngap = 0.05\ntangential_spin = [0, 0]",
    }
    scene = changed(
        tmp_path, air, radius=0.05, cylinder_radius=0.5, tilt=1.0, mu_static=0.5, speed=3.0, axial_speed=0.0
    )
    found = truth(scene, np.linspace(0.0, 0.6, 4))
    assert "ill_posed" not in found.attrs
    kinds = [event.kind for event in events_of(found)]
    assert kinds[:4] == ["impact"] * 4
    assert "settle" in kinds
    assert "lift_off" not in kinds


@pytest.mark.drill
def test_events_at_the_end_of_the_bounces_stand_in_order() -> None:
    """A slip that ends while the last bounces fade does not end before it began."""
    start = {"tilt": 0.219, "height": 0.153, "speed": -0.806, "cross_speed": 0.2, "side_spin": -40.8, "back_spin": 50.3}
    law = {"restitution": 0.228, "tangential_restitution": -0.115, "mu_static": 0.231, "mu_kinetic": 0.192}
    found = events_of(truth(load_scene("bouncing_ball", **start, **law), np.linspace(0.0, 0.4, 5)))
    kinds = [event.kind for event in found]
    assert kinds[:2] == ["impact", "impact"]
    assert kinds[-2:] == ["settle", "stick"]
    times = [event.time for event in found]
    assert times == sorted(times)
