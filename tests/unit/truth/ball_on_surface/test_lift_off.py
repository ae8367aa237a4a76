"""Where the normal force reaches zero the ball leaves the wall, under any law of friction, and flies until it lands."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core.dataset import ended_early
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.ball_on_surface.element import rolling_ball, scene_with
from proofroll.truth.ball_on_surface.implicit import Implicit
from proofroll.truth.ball_on_surface.polar import Polar
from proofroll.truth.ball_on_surface.switching import follow
from proofroll.truth.ball_on_surface.taylor import SlidingTaylor

C, G = 0.2, 9.81
# Start at the bottom, level: what a solid ball needs to pass the top, from energy and N = 0 there.
LEAST = math.sqrt(27 * G * C / 7)


def lying(speed: float, mu: float = math.inf, **parameters: float) -> Scene:
    """The paper's cylinder on its side; a ball starts at its bottom, across the axis."""
    scene = load_scene("sphere_in_cylinder", speed=speed, mu_static=mu, **parameters)
    return scene_with(scene, surface=replace(scene.elements[0].surface, tilt=math.pi / 2))


def test_the_start_is_at_the_bottom() -> None:
    """The scene that the formula holds for: the wall is below the ball, and its speed is level."""
    body = rolling_ball(lying(2.7))
    np.testing.assert_allclose(body.p0, [0, 0, -C], atol=1e-15)
    np.testing.assert_allclose(body.v0, [0, 2.7, 0], atol=1e-15)


def test_who_passes_the_top() -> None:
    """Below √(27 g c/7) the ball leaves the wall, above it does not, and the wall never pulls."""
    slow = truth(lying(0.999 * LEAST), np.linspace(0, 0.34, 35))
    assert [event.kind for event in events_of(slow)] == ["lift_off"]
    assert slow.N.min() >= -slow.N.error_bar
    assert "sticking" not in slow
    fast = truth(lying(1.001 * LEAST), np.linspace(0, 1.0, 101))
    assert events_of(fast) == []
    assert fast.attrs["smallest_N"] == float(fast.N[1:].min()) > 0


@pytest.mark.parametrize("route", [SlidingTaylor, Polar, Implicit])
def test_known_digits(route: Any) -> None:
    """At 2.4 m/s the ball leaves at 0.242029573 s and lands at 0.594832033 s in every route, to the last digit."""
    body = rolling_ball(lying(2.4))
    path = follow(body, route(body), 1.0)
    assert path.events == [("lift_off", pytest.approx(0.242029573, abs=1e-9))]
    assert path.end == pytest.approx(0.594832033, abs=1e-9)


def test_flight_is_a_parabola_with_constant_spin() -> None:
    """After lift-off the centre falls freely, nothing presses, and the spin stays."""
    dataset = truth(lying(2.7), np.linspace(0, 0.45, 91))
    (event,) = events_of(dataset)
    assert event.time_low <= event.time <= event.time_high < event.time_low + 1e-9
    flies = dataset.isel(time=dataset.time > event.time)
    np.testing.assert_allclose(
        np.diff(flies.p_WB, n=2, axis=0) / 0.005**2, [[0, 0, -G]] * (len(flies.time) - 2), atol=1e-8
    )
    assert not np.any(np.diff(flies.w_WB, axis=0))
    assert not np.any(flies.N)
    assert not np.any(np.signbit(flies.N))  # which a person would read as a pull
    assert float(flies.gap.min()) > 0


def test_the_truth_ends_at_a_landing() -> None:
    """A truth that ends where the ball lands has all values before; the sentence names the time and what is needed."""
    cut, whole = truth(lying(2.7), np.linspace(0, 1, 11)), truth(lying(2.7), np.linspace(0, 0.4, 5))
    end = ended_early(cut)
    assert end is not None
    assert re.search(r"lands at t = 0\.4591\d+ s; a restitution law would be needed", end[1])
    assert end[0] == pytest.approx(0.4591, abs=1e-4)
    assert cut["time"].to_numpy().tolist() == whole["time"].to_numpy().tolist()
    np.testing.assert_allclose(cut["p_WB"], whole["p_WB"], rtol=0, atol=1e-13)
    assert [event.kind for event in events_of(cut)] == [event.kind for event in events_of(whole)]
    assert float(cut["p_WB"].attrs["error_bar"]) < 1e-11


@pytest.mark.parametrize("route", [SlidingTaylor, Polar, Implicit])
@pytest.mark.parametrize("mu", [5.0, 0.5])
def test_with_a_bound_the_ball_slips_first(route: Any, mu: float) -> None:
    """F/N grows without limit towards N = 0, so friction of any bound slips before, once, and then the ball leaves."""
    body = rolling_ball(lying(2.7, mu))
    events = follow(body, route(body), 0.4).events
    assert [kind for kind, _ in events] == ["slip", "lift_off"]
    assert events[1][1] == pytest.approx({5.0: 0.272312848164, 0.5: 0.267707909078}[mu], abs=1e-11)


def test_a_ball_under_a_ceiling_falls_at_once() -> None:
    """Where nothing presses at time 0 the ball leaves then, and does not hang."""
    plane = load_scene("inclined_plane")
    plane = scene_with(plane, gravity=replace(plane.elements[0].gravity, direction=(0.0, 0.0, 1.0)))
    dataset = truth(plane, np.linspace(0, 0.5, 6))
    assert [(event.kind, event.time) for event in events_of(dataset)] == [("lift_off", 0.0)]
    assert not np.any(dataset.N)
