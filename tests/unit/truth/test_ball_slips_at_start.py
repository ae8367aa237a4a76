"""A ball that starts slipping on a level plane: Coulomb's closed form, whatever it starts with."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proofroll.core.errors import InputError
from proofroll.core.events import events_of
from proofroll.core.gravity import Gravity
from proofroll.core.truth import truth
from proofroll.elements.balls.reader import PlacedBall, ball_as_body
from proofroll.elements.balls.surfaces import Plane
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion
from proofroll.files.scene_file import load_scene

G, A = 9.81, 0.025
SPEEDS = st.floats(-3, 3)


@pytest.mark.nightly
@settings(max_examples=12, deadline=None)
@given(v=st.tuples(SPEEDS, SPEEDS), rims=st.tuples(SPEEDS, SPEEDS), k=st.floats(0.1, 1), mu=st.floats(0.05, 1))
def test_closed_form(v: tuple[float, float], rims: tuple[float, float], k: float, mu: float) -> None:
    """Slip keeps its direction and dies in |u| k / ((1 + k) μ g); speed and way are those of constant friction."""
    # Plane: e2 = x, e3 = -y, e1 = -z. Spin in units of rim speed; the contact point has v2 + a ω3 and v3 - a ω2.
    slip = np.array(v) + np.array([rims[1], -rims[0]])
    size = float(np.linalg.norm(slip))
    if size < 1e-3:
        return
    scene = load_scene(
        "slide_to_roll",
        speed=v[0],
        cross_speed=v[1],
        side_spin=rims[0] / A,
        back_spin=rims[1] / A,
        inertia_ratio=k,
        mu_static=mu,
    )
    rolls = size * k / ((1 + k) * mu * G)
    times = np.linspace(0, 1.5 * rolls, 11)
    found = truth(scene, times)

    braking = mu * G * slip / size
    until = np.minimum(times, rolls)[:, None]
    speed = np.array(v) - until * braking
    place = until * np.array(v) - 0.5 * until**2 * braking + (times[:, None] - until) * speed
    events = events_of(found)
    assert [event.kind for event in events] == ["stick"]
    assert events[0].time == pytest.approx(rolls, rel=1e-11)
    for index, name in enumerate(("down", "across")):
        bar = found[name].attrs["error_bar"] + 1e-15
        np.testing.assert_array_less(np.abs(found[name] - place[:, index]), bar)
    across = [speed[-1, 1] / A, -speed[-1, 0] / A]
    np.testing.assert_allclose([found["omega2"][-1], found["omega3"][-1]], across, rtol=0, atol=1e-9)


@pytest.mark.drill
def test_textbook() -> None:
    """Thrown without spin, a homogeneous ball rolls after 2 V0/(7 μ g) and 12 V0²/(49 μ g), with 5/7 V0."""
    v0, mu = 2.0, 0.2
    rolls = 2 * v0 / (7 * mu * G)
    found = truth(load_scene("slide_to_roll"), np.array([0.0, rolls, 2 * rolls]))
    assert found["down"][1] == pytest.approx(12 * v0**2 / (49 * mu * G), rel=1e-11)
    assert found["down_rate"][2] == pytest.approx(5 / 7 * v0, rel=1e-11)


@pytest.mark.drill
def test_backspin_returns() -> None:
    """With more backspin than V0/(k a) the ball comes back to where it started, and rolls on beyond."""
    back = truth(load_scene("slide_to_roll", back_spin=500), np.array([0.0, 3.0]))
    stays = truth(load_scene("slide_to_roll", back_spin=2 / (0.4 * A)), np.array([0.0, 3.0]))
    assert back["down"][1] < 0
    assert abs(float(stays["down_rate"][1])) < 1e-12


def test_spin_of_rolling_starts_rolling() -> None:
    """A spin that is that of rolling but for round-off is no slip, and needs no bound on friction."""
    scene = load_scene("slide_to_roll", speed=0.3, back_spin=-0.3 / A * (1 + 1e-15), mu_static=5.0)
    assert events_of(truth(scene, np.array([0.0, 0.1]))) == []


def test_what_has_no_motion_is_refused() -> None:
    """A spin that is no number, and a slip that unbounded friction would stop at once, give one line each."""
    with pytest.raises(InputError, match=r"tangential_spin = nan: the value must be a number"):
        InitialMotion("ball", tangential_spin=(0.0, math.nan))
    ball, start = Ball("ball", A, 1.0), InitialMotion("ball", tangential_spin=(0.0, 3.0))
    with pytest.raises(InputError, match=r"needs a number for mu_static") as error:
        ball_as_body(PlacedBall(ball, Plane("wall"), Contact("ball", "wall"), start), Gravity(G, (0, 0, -1)), "scene")
    assert "\n" not in str(error.value)
