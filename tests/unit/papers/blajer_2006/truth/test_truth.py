"""The truth of a ball that rolls: closed forms, published digits, and error bars."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import xarray as xr
from placed_balls import run_of, scene_with

from proofroll.core import heyoka_library as library
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.rolling_equations import closed_form

EVENTS = {"event_time", "event_low", "event_high"}
A, C, G, M = 0.025, 0.2, 9.81, 0.517


def final(dataset: xr.Dataset) -> dict[str, float]:
    """Values at the last time."""
    return {str(k): float(v[-1]) for k, v in dataset.data_vars.items() if v.dims == ("time",)}


@pytest.mark.parametrize("speed", [2.0, 4.0, 6.0, -4.0])
def test_closed_form_of_the_paper(speed: float) -> None:
    """For f = 0 the curves are those of the closed form, written out here a second time."""
    scene = load_scene("sphere_in_cylinder", speed=speed)
    t = np.linspace(0, 2, 41)
    motion = closed_form(rolling_ball(scene), t)
    assert motion is not None
    found = run_of(scene, t, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
    rate = speed / C
    nu = np.sqrt(2 / 7) * abs(rate)
    z = -5 * G / (2 * rate**2) * (1 - np.cos(nu * t))
    expected = {
        "gamma": rate * t,
        "z": z,
        "z_rate": -5 * G / (2 * rate**2) * nu * np.sin(nu * t),
        "omega1": rate * z / A,
        "omega3": np.full_like(t, -speed / A),
        "N": np.full_like(t, M * speed**2 / C),
        "F2": np.zeros_like(t),
        "F3": M * G * (1 - 5 / 7 * np.cos(nu * t)),
    }
    for name, values in expected.items():
        assert found[name].to_numpy() == pytest.approx(values, rel=1e-12, abs=1e-12), name


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.nightly_of("0.0005-asks1")
@pytest.mark.drill_of("0.0-asks1")
@pytest.mark.skipif(not library.available(), reason="heyoka is not installed")
@pytest.mark.parametrize("asks", [(), ("orientation",)])
@pytest.mark.parametrize("rolling_resistance", [0.0, 5e-4])
def test_series_leave_round_off(rolling_resistance: float, asks: tuple[str, ...]) -> None:
    """Forces have bars of 5e-14 of their size, whether or not the orientation is asked for."""
    scene = load_scene("sphere_in_cylinder", speed=4.0, rolling_resistance=rolling_resistance, asks=asks)
    found = truth(scene, np.linspace(0, 2, 101))
    assert max(found[name].attrs["error_bar"] for name in ("N", "F2", "F3")) <= 2e-12
    assert ("attitude" in found) == bool(asks)


@pytest.mark.nightly
@pytest.mark.skipif(not library.available(), reason="heyoka is not installed")
def test_ten_thousand_oscillations() -> None:
    """The height is known to a millionth of a radius after 10,000 oscillations."""
    found = truth(load_scene("sphere_in_cylinder"), np.linspace(0, 5900, 1001))
    assert 0 < found["z"].attrs["error_bar"] <= 1e-6 * A


def test_needed_friction_of_the_paper() -> None:
    """At V0 = 4 m/s without resistance the friction needed is at most (12/7) g c/V0² = 0.2102."""
    scene = load_scene("sphere_in_cylinder")
    half_period = np.pi / (np.sqrt(2 / 7) * 20)
    found = truth(scene, np.linspace(0, half_period, 11))["needed_friction"]
    assert float(found.max()) == pytest.approx(12 / 7 * G * C / 16, rel=1e-12)
    assert float(found.max()) == pytest.approx(0.2102, abs=5e-5)


# State where the needed friction first reaches 0.35, from an independent computation.
PAPER_CASE = {
    "gamma": 28.02160251, "z": -0.15342234, "gamma_rate": 13.44828166, "z_rate": -0.39505144,
    "omega1": -101.7254881, "needed_friction": 0.35,
}  # fmt: skip
PAPER_TIME = 1.720183172


def test_state_of_the_paper_case_with_resistance() -> None:
    """At f = 0.02a the state at 1.720183172 s is the published one to its last digit (the bound)."""
    found = final(truth(load_scene("sphere_in_cylinder", rolling_resistance=0.02 * A), np.array([0, PAPER_TIME])))
    for name, value in PAPER_CASE.items():
        assert found[name] == pytest.approx(value, rel=4e-9, abs=1e-8), name


@pytest.mark.parametrize(
    ("speed", "mu", "resistance", "time", "z"),
    [
        (2.0, 0.35, 0.0, 0.2166732, -0.1469),
        (2.0, 0.35, 0.02 * A, 0.20720339, None),
        (4.0, 0.15, 0.0, 0.176667992, None),
    ],
)
def test_first_slip_of_other_cases(speed: float, mu: float, resistance: float, time: float, z: float | None) -> None:
    """The friction needed reaches μ at the time at which other solvers see the first slip."""
    found = final(
        truth(load_scene("sphere_in_cylinder", speed=speed, rolling_resistance=resistance), np.array([0, time]))
    )
    assert found["needed_friction"] == pytest.approx(mu, abs=3e-7)
    if z is not None:
        assert found["z"] == pytest.approx(z, abs=5e-5)


@pytest.mark.drill
def test_plane_formulas() -> None:
    """Down a plane a = (5/7) g sin α, friction (2/7) m g sin α, N = m g cos α; across it the speed stays."""
    alpha, t = 0.35, np.linspace(0, 2, 9)
    found = truth(load_scene("inclined_plane", tilt=alpha, speed=0.5, cross_speed=0.2), t)
    acceleration = 5 / 7 * G * np.sin(alpha)
    assert found["down"].to_numpy() == pytest.approx(0.5 * t + 0.5 * acceleration * t**2, rel=1e-12)
    assert found["across"].to_numpy() == pytest.approx(0.2 * t, rel=1e-11)
    assert found["N"].to_numpy() == pytest.approx(M * G * np.cos(alpha), rel=1e-12)
    assert found["F2"].to_numpy() == pytest.approx(-2 / 7 * M * G * np.sin(alpha), rel=1e-11)
    assert found["F3"].to_numpy() == pytest.approx(0.0, abs=1e-11)


@pytest.mark.drill
def test_plane_with_resistance() -> None:
    """Straight down a plane the resistance lessens the acceleration by (5/7)(f/a) g cos α."""
    f, alpha = 1e-3, 0.35
    found = truth(load_scene("inclined_plane", rolling_resistance=f, cross_speed=0.0), np.linspace(0, 1, 5))
    expected = 5 / 7 * G * (np.sin(alpha) - f / A * np.cos(alpha))
    assert found["down_rate"].to_numpy() == pytest.approx(0.5 + expected * found["time"].to_numpy(), rel=1e-12)


@pytest.mark.parametrize("ratio", [0.4, 2 / 3])
@pytest.mark.parametrize(
    "parameters",
    [
        {"speed": -3.3, "axial_speed": 0.7, "radial_spin": 12.0},
        pytest.param({"speed": 0.5, "axial_speed": -2.0, "radial_spin": -30.0, "radius": 0.1}, marks=pytest.mark.drill),
        pytest.param({"gravity": 0.0, "axial_speed": 1.0}, marks=pytest.mark.drill),
    ],
)
def test_the_truth_is_the_closed_form_without_resistance(parameters: dict[str, float], ratio: float) -> None:
    """Motion and force of the general mechanics are those of the closed form for general initial motion."""
    scene = load_scene("sphere_in_cylinder", **parameters)
    scene = scene_with(scene, ball=dataclasses.replace(rolling_ball(scene).ball, inertia_ratio=ratio))
    body, t = rolling_ball(scene), np.linspace(0, 0.5, 6)
    motion, found = closed_form(body, t), truth(scene, t)
    assert motion is not None
    exact = run_of(scene, t, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
    for name in ("p_WB", "v_WB", "w_WB", "N", "F2", "F3"):
        size = max(1.0, float(np.max(np.abs(exact[name]))))
        np.testing.assert_allclose(found[name], exact[name], rtol=0, atol=1e-11 * size, err_msg=name)


def test_closed_form_only_where_it_holds() -> None:
    """With resistance there is no closed form."""
    resisted = rolling_ball(load_scene("sphere_in_cylinder", rolling_resistance=1e-6))
    assert closed_form(resisted, np.zeros(1)) is None


def test_every_value_has_an_error_bar(scene: Scene) -> None:
    """No error bar is zero, and none exceeds 1e-10 of the sizes in the scene."""
    found = truth(scene, np.linspace(0, 0.1, 3))
    body = rolling_ball(scene)
    sizes = {"rad": 1.0, "m": 1.0, "N": 50.0, "J": 10.0, "m/s": 5.0, "rad/s": 200.0, "1": 1.0, "N m": 10.0}
    assert body.ball.mass == M
    for name, values in found.data_vars.items():
        if not np.issubdtype(values.dtype, np.floating) or name in EVENTS:
            continue
        bar = values.attrs["error_bar"]
        assert bar <= 1e-10 * sizes[values.attrs["units"]], name
        if np.any(values.to_numpy()):
            assert bar > 0, name


@pytest.mark.nightly
def test_friction_that_is_never_needed_changes_nothing() -> None:
    """As long as the friction needed stays below a bound, the bound does not show."""
    t = np.linspace(0, 0.5, 6)
    free, bounded = (truth(load_scene("sphere_in_cylinder", **p), t) for p in ({}, {"mu_static": 0.3}))
    for name in ("p_WB", "v_WB", "w_WB", "N", "F3"):
        assert bounded[name].to_numpy().reshape(free[name].shape) == pytest.approx(
            free[name].to_numpy(), rel=1e-11, abs=1e-11
        ), name
