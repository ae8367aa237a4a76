"""Where rolling resistance stops a ball: it stays or sets off, whatever the friction, and nothing reverses it."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest
import xarray as xr

from proofroll.core.dataset import ended_early
from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.mechanics import can_rest, setting_off
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.contacts.audits import energy_balance
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

G, A = 9.81, 0.025
EULER, FRAME = "projection[formulation=euler]", "projection[formulation=rotating_frame]"
RK4 = "projection[formulation=rotating_frame,preset=default]"


def test_a_ball_that_rolls_for_minutes_comes_to_rest() -> None:
    """After 195 s no step is asked for that the round-off of the time hides; the ball stops at (1 + k) a V0/(f g)."""
    speed, f, k = 0.6970627537995008, 1e-5, 0.1
    scene = load_scene("rolling_stop", speed=speed, rolling_resistance=f, inertia_ratio=k)
    stops = (1 + k) * A * speed / (f * G)
    found = truth(scene, np.array([0.0, stops / 2, 1.1 * stops]))
    assert float(found["down"][-1]) == pytest.approx(stops * speed / 2, abs=float(found["down"].attrs["error_bar"]))


@pytest.mark.parametrize("f", [5e-4, 3 * A])
@pytest.mark.parametrize("engine", ["truth", EULER, FRAME, RK4])
def test_a_level_plane(engine: str, f: float) -> None:
    """The ball stops after V²/(2 · 5/7 g f/a), also where f is larger than the ball, and never moves again."""
    scene = load_scene("inclined_plane", tilt=0, speed=0.06, cross_speed=0.08, normal_spin=4, rolling_resistance=f)
    found = simulate(scene, engine, until=2.0, every=0.05)
    assert found.attrs["status"] == "done"
    way = 0.1**2 / (2 * 5 / 7 * G * f / A)
    np.testing.assert_allclose(found["p_WB"][-1, :2], [0.6 * way, -0.8 * way], rtol=0, atol=1e-9 * way)
    stopped = found["time"].to_numpy() > 1.01 * 2 * way / 0.1
    assert np.any(stopped)
    np.testing.assert_allclose(found["v_WB"][stopped], 0.0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found["omega1"][stopped], 4.0, rtol=1e-12)
    speed = np.linalg.norm(found["v_WB"], axis=-1)
    assert np.all(np.diff(speed) < 1e-13)


@cache
def _rolled_up(f: float, cross_speed: float) -> xr.Dataset:
    """The truth of a ball that rolls up a slope."""
    scene = load_scene("inclined_plane", tilt=-0.35, cross_speed=cross_speed, rolling_resistance=f)
    return simulate(scene, "truth", until=0.5, every=0.05)


@pytest.mark.parametrize("engine", [EULER, FRAME, RK4])
@pytest.mark.parametrize("cross_speed", [0.0, 0.2])
@pytest.mark.parametrize("f", [1e-3, 0.02])
def test_rolling_up_a_slope(engine: str, f: float, cross_speed: float) -> None:
    """At the highest point the ball rolls back if f/a is less than tan α, else it stays there by friction's force."""
    scene = load_scene("inclined_plane", tilt=-0.35, cross_speed=cross_speed, rolling_resistance=f)
    true = _rolled_up(f, cross_speed)
    found = simulate(scene, engine, until=0.5, every=0.05)
    accuracy = 1e-6 if engine == RK4 else 1e-11
    for name in ("p_WB", "v_WB", "N", "F2"):
        np.testing.assert_allclose(found[name], true[name], rtol=0, atol=accuracy, err_msg=name)
    rests = f / A > np.tan(0.35)
    assert bool(np.max(np.abs(found["v_WB"][-1])) < 1e-13) == rests


@pytest.mark.parametrize("engine", ["truth", EULER, FRAME, RK4])
@pytest.mark.parametrize(("f", "acceleration"), [(1e-3, (np.sin(0.35) - 0.04 * np.cos(0.35)) * 5 / 7 * G), (0.02, 0.0)])
def test_a_start_from_rest(engine: str, f: float, acceleration: float) -> None:
    """A ball released at rest sets off against the resistance where gravity is stronger, and else stays."""
    scene = load_scene("inclined_plane", speed=0, cross_speed=0, rolling_resistance=f)
    found = simulate(scene, engine, until=0.5, every=0.1)
    way = found["down"].to_numpy()
    np.testing.assert_allclose(way, 0.5 * acceleration * found["time"].to_numpy() ** 2, rtol=0, atol=1e-10)


@pytest.mark.drill
def test_less_and_less_to_and_fro() -> None:
    """A ball that slips to a stop and back infinitely often in a finite time comes to rest at the end of that time."""
    f, mu, v = 3e-3, 0.08, 0.5
    scene = load_scene("inclined_plane", tilt=0, speed=v, cross_speed=0, rolling_resistance=f, mu_static=mu)
    found = simulate(scene, "truth", until=1.0, every=0.1)
    # Half a cycle: friction stops the centre while the contact slips ever faster, and reverses it until it slips no
    # more. With φ = f/a, κ = 2/5: u̇ = g ((φ - μ)/κ - μ), then -g ((φ + μ)/κ + μ); every half the speed is r times less.
    phi, kappa = f / A, 0.4
    slipping = ((phi - mu) / kappa - mu) * v / mu
    back = slipping / (mu + (phi + mu) / kappa)
    r = mu * back / v
    end = (v / mu + back) / G / (1 - r)
    assert [(event.kind, event.time) for event in events_of(found)] == [
        ("slip", 0.0),
        ("stick", pytest.approx(end, abs=2e-8)),
    ]
    assert np.all(found["v_WB"].to_numpy()[found["time"].to_numpy() > end] == 0)
    way = (v**2 / (2 * mu) - mu * back**2 / 2) / G / (1 + r**2)
    assert float(found["down"][-1]) == pytest.approx(way, abs=1e-9)


@pytest.mark.drill
def test_too_much_to_and_fro_ends_the_truth() -> None:
    """Where the reversals shrink so slowly that they would cost minutes, the truth ends, and one sentence says so."""
    scene = load_scene("inclined_plane", tilt=0, rolling_resistance=0.025, mu_static=0.3)
    end = ended_early(simulate(scene, "truth", until=2.0, every=0.5))
    assert end is not None
    assert re.match(r"from about 0\.4\d+ s on the ball slips to and fro ever faster", end[1])


def test_the_energy_of_a_ball_that_stops() -> None:
    """The balance holds up to the stop and beyond, to the square of the interval between samples."""
    scene = load_scene("inclined_plane", tilt=0, rolling_resistance=3e-3)
    worst = []
    for every in (0.02, 0.005):
        found = simulate(scene, "truth", until=1.0, every=every)
        worst.append(np.max(np.abs(energy_balance(rolling_ball(scene), found))) / np.ptp(found["energy"].to_numpy()))
    assert worst[0] < 1e-3
    assert worst[1] < worst[0] / 2


@pytest.mark.parametrize("speed", [0.05, 0.5])
def test_slowing_down_on_the_cylinder(speed: float) -> None:
    """In a vertical cylinder γ̇ falls for ever and never reverses, and nothing but γ̇ presses the ball on: it falls."""
    scene = load_scene("sphere_in_cylinder", speed=speed, rolling_resistance=0.05)
    for engine in ("truth", FRAME):
        found = simulate(scene, engine, until=1.0, every=0.1)
        assert found.attrs["status"] == "done"
        rate, N = found["gamma_rate"].to_numpy(), found["N"].to_numpy()
        assert np.all(rate > 0)
        assert np.all(np.diff(rate) < 0)
        np.testing.assert_allclose(N, 0.517 * 0.2 * rate**2, rtol=1e-9)
        assert float(found["z"][-1]) < float(found["z"][-2])


def test_what_holds_a_ball_at_rest() -> None:
    """Both the resistance's moment and the friction must suffice; a ball that nothing must hold needs neither."""

    def body(**parameters: float) -> RollingBall:
        return rolling_ball(load_scene("inclined_plane", **parameters))

    steep = A * np.tan(0.35)
    for f, mu, expected in (
        (1.01 * steep, np.inf, True),
        (0.99 * steep, np.inf, False),
        (1, 0.37, True),
        (1, 0.36, False),
    ):
        ball = body(rolling_resistance=f, mu_static=mu)
        assert can_rest(ball, ball.p0) == expected
    level = body(tilt=0, rolling_resistance=1e-9, mu_static=0)
    assert can_rest(level, level.p0)
    assert not np.any(setting_off(level, level.p0))
