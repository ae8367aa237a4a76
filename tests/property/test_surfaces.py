"""Closed forms on surfaces, at random parameters: of the equations at one instant, which cost no integration."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proofroll.core.events import events_of
from proofroll.core.gravity import Gravity
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.balls.reader import PlacedBall, ball_as_body
from proofroll.elements.balls.surfaces import Bowl, Cone, Plane, Torus
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion
from proofroll.elements.mechanism.scene.shapes.walls import BowlWall
from proofroll.elements.mechanism.scene.shapes.walls.charts import wall_coordinates
from proofroll.files.scene_file import load_scene

G = 9.81


def element(surface: Any, ratio: float, u0: Any, velocity: Any, spin: float, a: float = 0.025) -> MechanismElement:
    """A ball of 1 kg that starts so, as a body with a sphere on a wall."""
    start = InitialMotion("ball", tuple(u0), tuple(velocity), spin)
    placed = PlacedBall(Ball("ball", a, 1.0, ratio), surface, Contact("ball", "wall"), start)
    return ball_as_body(placed, Gravity(G, (0, 0, -1)), "scene")


def steady_rate(k: float, a: float, rho: float, slope: float, spin: float) -> float:
    """Rate W of a steady circle: (1 + k) ρ W² cos β - k a W ω_n sin β = g sin β (Routh 1905), ω_n the outward spin."""
    A, B, C = (1 + k) * rho * np.cos(slope), -k * a * spin * np.sin(slope), -G * np.sin(slope)
    return float((-B + np.sqrt(B * B - 4 * A * C)) / (2 * A))


def held_circle(ball: MechanismElement, W: float) -> None:
    """Its first acceleration is that of the circle about the axis, and its spin about the normal stays."""
    body, first = ball.on_wall, ball.first_motion
    assert body is not None
    p0 = body.surface.position(body.u0)
    assert first.acceleration[body.index] == pytest.approx(-(W**2) * np.array([*p0[:2], 0.0]), abs=1e-9 * G)
    e1, e1_rate = body.surface.normal(p0), body.surface.normal_gradient(p0) @ body.v0
    spin_rate = float(first.angular_acceleration[body.index] @ e1 + body.w0 @ e1_rate)
    assert spin_rate == pytest.approx(0.0, abs=1e-9 * abs(W) ** 2 + 1e-9)


ratios, spins = st.floats(0.1, 0.66), st.floats(-60.0, 60.0)


@pytest.mark.drill
@settings(max_examples=30, deadline=None)
@given(radius=st.floats(0.06, 3.0), slope=st.floats(0.05, 1.3), k=ratios, spin=spins, around=st.floats(-3, 3))
def test_steady_circles_in_a_bowl(radius: float, slope: float, k: float, spin: float, around: float) -> None:
    """A ball at the rate of the closed form goes on in its circle, wherever it is and however it spins."""
    a, reach = 0.025, radius - 0.025
    W = steady_rate(k, a, reach * np.sin(slope), slope, spin)
    u = 2 * reach * np.tan(slope / 2) * np.array([np.cos(around), -np.sin(around)])
    speed = W * reach * np.sin(slope)
    frame = wall_coordinates(BowlWall(np.zeros(3), np.array([0.0, 0.0, 1.0]), radius), a).frame(u)
    forward = np.array([-np.sin(around), np.cos(around), 0.0])
    held_circle(element(Bowl("wall", radius), k, u, speed * (frame[:, 1:].T @ forward), spin), W)


@pytest.mark.nightly
@settings(max_examples=30, deadline=None)
@given(way=st.floats(0.06, 3.0), slope=st.floats(0.05, 1.4), k=ratios, spin=spins, around=st.floats(-3, 3))
def test_steady_circles_in_a_cone(way: float, slope: float, k: float, spin: float, around: float) -> None:
    """As in a bowl, on a wall whose curvature changes with the way from the tip."""
    W = steady_rate(k, 0.025, way * np.cos(slope), slope, spin)
    held_circle(element(Cone("wall", slope), k, (around, way), (W * way * np.cos(slope), 0.0), spin), W)


@pytest.mark.nightly
@settings(max_examples=30, deadline=None)
@given(ring=st.floats(0.2, 3.0), wire=st.floats(0.01, 0.1), slope=st.floats(0.05, 1.4), k=ratios, spin=spins)
def test_steady_circles_on_a_ring(ring: float, wire: float, slope: float, k: float, spin: float) -> None:
    """As in a bowl, leaning inward on a wire: the formula does not ask whether the wall is hollow."""
    a = 0.025
    rho = ring - (wire + a) * np.sin(slope)
    W = steady_rate(k, a, rho, slope, spin)
    held_circle(element(Torus("wall", ring, wire), k, (0.3, -slope), (W * rho, 0.0), spin), W)


@pytest.mark.nightly
@settings(max_examples=30, deadline=None)
@given(W=st.floats(0.1, 20.0), k=ratios, x=st.floats(-2, 2), vx=st.floats(-2, 2), vy=st.floats(-2, 2), spin=spins)
def test_circles_on_a_turntable(W: float, k: float, x: float, vx: float, vy: float, spin: float) -> None:
    """At the rate k/(1 + k) W of the velocity, whatever the spin and the place: the ball begins a circle."""
    ball = element(Plane("wall", turning=W), k, (x, 0.0), (vx, vy), spin)
    body, first = ball.on_wall, ball.first_motion
    assert body is not None
    expected = np.cross([0.0, 0.0, 1.0], body.v0) * k / (1 + k) * W
    assert first.acceleration[body.index] == pytest.approx(expected, abs=1e-12 * (1 + W) ** 2 * 40)


@pytest.mark.drill
def test_a_ball_on_the_rim_leaves_it_in_both_routes() -> None:
    """It leaves where N reaches zero, and falls on a parabola with the spin that it has."""
    scene = load_scene("torus_rim", speed=1.0)
    t = np.linspace(0, 0.7, 71)
    found = truth(scene, t)
    (event,) = events_of(found)
    found = found.isel(body=0)
    assert event.kind == "lift_off"
    assert event.time_high - event.time_low < 1e-9
    falls = t > event.time
    z_second = np.diff(found["p_WB"].to_numpy()[falls][:, 2], 2) / 0.01**2
    assert z_second == pytest.approx(-G, abs=1e-8)
    assert np.ptp(found["w_WB"].to_numpy()[falls], axis=0) == pytest.approx(0.0, abs=1e-9)
    assert float(found["gap"][-1]) > 0.1


@pytest.mark.nightly
def test_a_truth_ends_at_the_tip_of_a_cone() -> None:
    """A ball that rolls straight into it has values up to there, with a constant acceleration, and the true reason."""
    scene = load_scene("cone", speed=0.0, normal_spin=0.0)
    t = np.linspace(0, 2.0, 21)
    found = truth(scene, t)
    rising, k, slope, start = 0.2, 0.4, 0.6, 0.3
    down = G * np.sin(slope) / (1 + k)
    end = (rising + np.sqrt(rising**2 + 2 * down * start)) / down
    assert found.attrs["ends"] == pytest.approx(end, rel=1e-4)
    assert "comes to the tip of its cone" in found.attrs["ended"]
    known = t[: found.sizes["time"]]
    assert found["s"].to_numpy() == pytest.approx(start + rising * known - down * known**2 / 2, abs=1e-12)


@pytest.mark.drill
def test_a_small_swing_passes_the_bottom_of_a_bowl() -> None:
    """From rest it swings at ω² = g/((1 + k)(R - a)), through the bottom, with an error bar near round-off."""
    amplitude, R, a, k = 1e-4, 0.225, 0.025, 0.4
    scene = Scene("swing", "", (element(Bowl("wall", R), k, (amplitude, 0.0), (0.0, 0.0), 0.0),))
    t = np.linspace(0, 1.0, 51)
    found = truth(scene, t)
    expected = amplitude * np.cos(np.sqrt(G / ((1 + k) * (R - a))) * t)
    assert found["xi"].to_numpy() == pytest.approx(expected, abs=1e-5 * amplitude)
    assert found["xi"].attrs["error_bar"] < 1e-10 * amplitude
    assert np.abs(found["eta"]).max() == 0.0


@pytest.mark.nightly
def test_a_ball_through_the_bottom_is_the_limit_of_balls_that_pass_it(times: np.ndarray) -> None:
    """Nothing happens at the bottom: with a side speed of 1e-6 m/s the motion is the same to as much."""
    scenes = [Scene("s", "", (element(Bowl("wall", 0.225), 0.4, (0.1, 0), (0.0, v), 0.0),)) for v in (0.0, 1e-6)]
    straight, beside = (truth(scene, times[:51]) for scene in scenes)
    assert np.abs(straight["p_WB"] - beside["p_WB"]).max() < 1e-5
