"""Rolling resistance of bodies in MuJoCo: a torque of the size f N against the turning, that holds what it stops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import Refused
from proofroll.core.events import events_of
from proofroll.core.plugins import load_engine
from proofroll.files.scene_file import load_scene

A, G, F = 0.025, 9.81, 5e-4  # radius of the ball [m], gravity [m/s²], and the usual lever of the resistance [m]
ROLLS = 1.4  # a solid ball's mass and what its turning adds, in masses
GEOMS = ["mujoco[formulation=geoms,preset=matched]", "mujoco[formulation=geoms,preset=tuned]"]


def run(name: str, engine: str, until: float, every: float, **parameters: Any) -> tuple[np.ndarray, np.ndarray]:
    """Places [m] and velocities [m/s] of a ball read as a body, (time, 3)."""
    motion = proofroll.simulate(load_scene(name, **parameters), engine, until=until, every=every)
    return motion["p_WB"].values[:, 0], motion["v_WB"].values[:, 0]


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("engine", GEOMS)
def test_a_ball_stops_where_its_resistance_stops_it_and_rests(engine: str) -> None:
    """Its way is that of an even braking but for half a step of it, and nothing moves afterwards."""
    speed, braking, dt = 0.05, F * G / A / ROLLS, 1e-3
    p, v = run("rolling_stop", engine, 0.6, 0.05, speed=speed, rolling_resistance=F)
    way = np.linalg.norm(p[-1] - p[0])
    assert way == pytest.approx(speed**2 / (2 * braking) - speed * dt / 2, abs=1e-7)
    assert np.abs(v[9:]).max() < 1e-9
    assert np.abs(p[9:] - p[-1]).max() < 1e-9


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("engine", GEOMS)
def test_a_ball_rolls_down_by_what_resistance_leaves(engine: str) -> None:
    """Its acceleration is g (sin - f/a cos) / 1.4, and on a slope below f/a it stays."""
    _, v = run("inclined_plane", engine, 0.5, 0.1, tilt=0.35, speed=0, cross_speed=0, rolling_resistance=F)
    rate = G * (np.sin(0.35) - F / A * np.cos(0.35)) / ROLLS
    assert np.linalg.norm(v[-1]) == pytest.approx(0.5 * rate, rel=2e-5)
    p, v = run("inclined_plane", engine, 0.5, 0.1, tilt=0.01, speed=0, cross_speed=0, rolling_resistance=F)
    assert np.abs(p - p[0]).max() < 1e-6
    assert np.abs(v[1:]).max() < 1e-7  # it creeps, as its contact is soft


@pytest.mark.drill
def test_what_slips_is_resisted_too() -> None:
    """A ball that slides and begins to turn has the moment while it slips, as its truth has."""
    parameters = {"rolling_resistance": 2e-3}
    scene = load_scene("slide_to_roll", **parameters)
    found = proofroll.simulate(scene, GEOMS[1], until=0.2, every=0.05)
    true = proofroll.simulate(scene, "truth", until=0.2, every=0.05)
    for field, largest in (("v_WB", 1e-3), ("w_WB", 0.25)):  # a step of friction: 2e-3 m/s and 0.2 rad/s
        assert np.abs(found[field].values - true[field].values).max() < largest
    assert np.abs(true["w_WB"].values).max() > 10


@pytest.mark.nightly
def test_a_bowl_keeps_second_order() -> None:
    """Half the step has a quarter of the error with curvature and resistance."""
    scene, grid = load_scene("bowl", rolling_resistance=1e-3), {"until": 0.2, "every": 0.04}
    right = proofroll.simulate(scene, "truth", **grid)["p_WB"].values
    errors = [
        np.abs(proofroll.simulate(scene, f"{GEOMS[1][:-1]},dt={dt}]", **grid)["p_WB"].values - right).max()
        for dt in (4e-3, 2e-3)
    ]
    assert errors[1] < 2e-6
    assert 3.5 < errors[0] / errors[1] < 4.5


@pytest.mark.nightly
def test_the_articles_ball_slips_when_its_truth_does() -> None:
    """With resistance and friction of 0.35 the ball in the cylinder slips at 1.72018 s, by its truth."""
    scene = load_scene("sphere_in_cylinder", speed=4, mu_static=0.35, rolling_resistance=F)
    (slip,) = events_of(proofroll.simulate(scene, GEOMS[1], until=1.8, every=0.02))
    assert slip.time == pytest.approx(1.720183, abs=2e-3)


def test_no_mjcf_has_the_torque() -> None:
    """The model alone would roll on, so that it is not given away."""
    engine = load_engine("mujoco")
    built = engine.build(load_scene("rolling_stop"), engine.presets["geoms"]["matched"])
    with pytest.raises(Refused, match="rolling resistance"):
        built.spec()
