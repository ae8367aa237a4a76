"""Closed forms on surfaces, at random parameters: of the equations at one instant, which cost no integration."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.events import events_of
from proofroll.core.gravity import Gravity
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import BallOnSurface
from proofroll.elements.ball_on_surface.mechanics import newton_euler
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.rolling_equations import closed_form, reduced_rates, start
from proofroll.elements.ball_on_surface.surfaces import Bowl, Cone, Plane, Torus
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion
from proofroll.files.scene_file import load_scene
from proofroll.truth.ball_on_surface.plug_in import truth

G = 9.81


def rolling(surface: Any, ratio: float, u0: Any, velocity: Any, spin: float, a: float = 0.025) -> RollingBall:
    """A ball of 1 kg that starts so."""
    return element(surface, ratio, u0, velocity, spin, a).rolling


def element(surface: Any, ratio: float, u0: Any, velocity: Any, spin: float, a: float = 0.025) -> BallOnSurface:
    """The same as an element of a scene."""
    start_ = InitialMotion("ball", tuple(u0), tuple(velocity), spin)
    return BallOnSurface(Ball("ball", a, 1.0, ratio), surface, Contact("ball", "wall"), start_, Gravity(G, (0, 0, -1)))


def steady_rate(k: float, a: float, rho: float, slope: float, spin: float) -> float:
    """Rate W of a steady circle: (1 + k) ρ W² cos β - k a W ω_n sin β = g sin β (Routh 1905), ω_n the outward spin."""
    A, B, C = (1 + k) * rho * np.cos(slope), -k * a * spin * np.sin(slope), -G * np.sin(slope)
    return float((-B + np.sqrt(B * B - 4 * A * C)) / (2 * A))


def held_circle(body: RollingBall, W: float) -> None:
    """Both descriptions of the surface give the acceleration of the circle about the axis, and a spin that stays."""
    rho = np.array([*body.p0[:2], 0.0])
    acceleration, _, _ = newton_euler(body, body.p0, body.v0, body.w0)
    assert acceleration == pytest.approx(-(W**2) * rho, abs=1e-9 * G)
    rates, _, force = reduced_rates(body, start(body))
    assert force / body.ball.mass + body.gravity == pytest.approx(-(W**2) * rho, abs=1e-9 * G)
    assert rates[4] == pytest.approx(0.0, abs=1e-9 * abs(W) ** 2 + 1e-9)


ratios, spins = st.floats(0.1, 0.66), st.floats(-60.0, 60.0)


@settings(max_examples=30, deadline=None)
@given(radius=st.floats(0.06, 3.0), slope=st.floats(0.05, 1.3), k=ratios, spin=spins, around=st.floats(-3, 3))
def test_steady_circles_in_a_bowl(radius: float, slope: float, k: float, spin: float, around: float) -> None:
    """A ball at the rate of the closed form goes on in its circle, wherever it is and however it spins."""
    a, reach = 0.025, radius - 0.025
    W = steady_rate(k, a, reach * np.sin(slope), slope, spin)
    u = 2 * reach * np.tan(slope / 2) * np.array([np.cos(around), -np.sin(around)])
    speed = W * reach * np.sin(slope)
    frame = Bowl("wall", reach).frame(u)
    forward = np.array([-np.sin(around), np.cos(around), 0.0])
    held_circle(rolling(Bowl("wall", radius), k, u, speed * (frame[:, 1:].T @ forward), spin), W)


@settings(max_examples=30, deadline=None)
@given(way=st.floats(0.06, 3.0), slope=st.floats(0.05, 1.4), k=ratios, spin=spins, around=st.floats(-3, 3))
def test_steady_circles_in_a_cone(way: float, slope: float, k: float, spin: float, around: float) -> None:
    """As in a bowl, on a wall whose curvature changes with the way from the tip."""
    W = steady_rate(k, 0.025, way * np.cos(slope), slope, spin)
    held_circle(rolling(Cone("wall", slope), k, (around, way), (W * way * np.cos(slope), 0.0), spin), W)


@settings(max_examples=30, deadline=None)
@given(ring=st.floats(0.2, 3.0), wire=st.floats(0.01, 0.1), slope=st.floats(0.05, 1.4), k=ratios, spin=spins)
def test_steady_circles_on_a_ring(ring: float, wire: float, slope: float, k: float, spin: float) -> None:
    """As in a bowl, leaning inward on a wire: the formula does not ask whether the wall is hollow."""
    a = 0.025
    rho = ring - (wire + a) * np.sin(slope)
    W = steady_rate(k, a, rho, slope, spin)
    held_circle(rolling(Torus("wall", ring, wire), k, (0.3, -slope), (W * rho, 0.0), spin), W)


@settings(max_examples=30, deadline=None)
@given(W=st.floats(0.1, 20.0), k=ratios, x=st.floats(-2, 2), vx=st.floats(-2, 2), vy=st.floats(-2, 2), spin=spins)
def test_circles_on_a_turntable(W: float, k: float, x: float, vx: float, vy: float, spin: float) -> None:
    """About p0 + ẑ × v0/W' with the radius v0/W' at W' = k/(1 + k) W, whatever the spin; so both routes begin too."""
    body = rolling(Plane("wall", turning=W), k, (x, 0.0), (vx, vy), spin)
    rate = k / (1 + k) * W
    up = np.array([0.0, 0.0, 1.0])
    expected = np.cross(up, body.v0) * rate
    close = 1e-12 * (1 + W) ** 2 * 40
    assert newton_euler(body, body.p0, body.v0, body.w0)[0] == pytest.approx(expected, abs=close)
    assert reduced_rates(body, start(body))[2] / body.ball.mass + body.gravity == pytest.approx(expected, abs=close)
    t = np.linspace(0, 3 * np.pi / rate, 7)
    motion = closed_form(body, t)
    assert motion is not None
    centre = body.p0 + np.cross(up, body.v0) / rate
    away = np.linalg.norm(motion.p_WB - centre, axis=1)
    assert away == pytest.approx(np.linalg.norm(body.v0) / rate, rel=1e-12, abs=1e-12)
    wall = np.cross([0, 0, W], motion.p_WB - 0.025 * up)
    assert motion.v_WB - 0.025 * np.cross(motion.w_WB, up) == pytest.approx(wall, abs=1e-11 * (1 + W))


def test_circles_on_a_tilted_turntable_drift_across() -> None:
    """With g sin α / (k W) across the slope, not down it; both routes of the truth agree."""
    tilt, W, k = 0.1, 3.0, 0.4
    scene = Scene("t", "", (element(Plane("wall", tilt, turning=W), k, (0.3, 0.0), (0.1, 0.2), 0.0),))
    period = 2 * np.pi * (1 + k) / (k * W)
    found = truth(scene, np.linspace(0, period, 8))
    moved = found["p_WB"].to_numpy()[-1] - found["p_WB"].to_numpy()[0]
    assert moved == pytest.approx([0.0, G * np.sin(tilt) / (k * W) * period, 0.0], abs=1e-12)
    assert found["across"].attrs["error_bar"] < 1e-12


def test_on_a_wall_that_moves_a_ball_only_rolls() -> None:
    """Where nothing is known of slip or resistance, one line says so."""
    slippery = Contact("ball", "wall", 0.0, 0.3, 0.3)
    with pytest.raises(InputError, match="only rolls"):
        dataclasses.replace(element(Plane("wall", turning=1.0), 0.4, (0, 0), (0, 0), 0.0), contact=slippery)


def test_a_ball_on_the_rim_leaves_it_in_both_routes() -> None:
    """It leaves where N reaches zero, and falls on a parabola with the spin that it has."""
    scene = load_scene("torus_rim", speed=1.0)
    t = np.linspace(0, 0.7, 71)
    found = truth(scene, t)
    (event,) = events_of(found)
    assert event.kind == "lift_off"
    assert event.time_high - event.time_low < 1e-9
    falls = t > event.time
    z_second = np.diff(found["p_WB"].to_numpy()[falls][:, 2], 2) / 0.01**2
    assert z_second == pytest.approx(-G, abs=1e-8)
    assert np.ptp(found["w_WB"].to_numpy()[falls], axis=0) == pytest.approx(0.0, abs=1e-9)
    assert float(found["gap"][-1]) > 0.1


def test_a_ball_that_rolls_into_the_tip_of_a_cone_is_no_endless_run() -> None:
    """There the wall has no direction: whatever is said of it, it is said."""
    with pytest.raises(ProofrollError):
        truth(load_scene("cone", speed=0.0, normal_spin=0.0), np.linspace(0, 2.0, 21))


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


def test_a_ball_through_the_bottom_is_the_limit_of_balls_that_pass_it(times: np.ndarray) -> None:
    """Nothing happens at the bottom: with a side speed of 1e-6 m/s the motion is the same to as much."""
    scenes = [Scene("s", "", (element(Bowl("wall", 0.225), 0.4, (0.1, 0), (0.0, v), 0.0),)) for v in (0.0, 1e-6)]
    straight, beside = (truth(scene, times[:51]) for scene in scenes)
    assert np.abs(straight["p_WB"] - beside["p_WB"]).max() < 1e-5
