"""Rolling resistance brings a ball to rest on a level plane, and there it stays, in whatever engine."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

G, A = 9.81, 0.025
# Engine, then three times what it was measured to leave of the way [m] and of the speed at rest [m/s]: errors of its
# method at its step, which no processor changes; ten times where they are round-off.
ENGINES = [
    ("projection[formulation=euler]", 4e-12, 0.0),
    ("pinocchio[formulation=contact]", 2e-8, 1e-15),
    ("exudyn[formulation=generic,preset=default]", 2e-5, 1e-12),
    ("exudyn[formulation=carrier,preset=default]", 5e-5, 1e-9),
    ("exudyn[formulation=rolling_disc,preset=default]", 5e-5, 1e-9),
    ("exudyn[formulation=contact,preset=default]", 5e-5, 1e-9),
    ("mujoco[formulation=chart]", 2e-7, 1e-10),
    ("mujoco[formulation=free,preset=tuned]", 2e-7, 1e-10),
]


@pytest.mark.drill
@settings(max_examples=10, deadline=None)
@given(speed=st.floats(0.01, 3), f=st.floats(1e-5, 0.01), k=st.floats(0.1, 1))
def test_closed_form(speed: float, f: float, k: float) -> None:
    """The ball stops after (1 + k) a V0/(f g) and (1 + k) a V0²/(2 f g), and stays."""
    stops = (1 + k) * A * speed / (f * G)
    scene = load_scene("rolling_stop", speed=speed, rolling_resistance=f, inertia_ratio=k)
    found = simulate(scene, "truth", until=2 * stops, every=stops / 2)
    way = 0.5 * stops * speed
    bar = found["down"].attrs["error_bar"] + 1e-14 * way
    np.testing.assert_allclose(found["down"], np.array([0, 0.75, 1, 1, 1]) * way, rtol=0, atol=bar)
    np.testing.assert_array_equal(found["down_rate"][3:], 0.0)


@pytest.mark.parametrize(("engine", "way", "speed"), ENGINES)
def test_it_stops_and_stays(engine: str, way: float, speed: float) -> None:
    """A ball that rolls obliquely stops where the closed form says, does not come back and does not creep on."""
    scene = load_scene("rolling_stop", speed=0.08, cross_speed=0.06, rolling_resistance=1e-3)
    found = simulate(scene, engine, until=0.8, every=0.04)
    assert found.attrs["status"] == "done"
    stops = 1.4 * A * 0.1 / (1e-3 * G)
    np.testing.assert_allclose(found["down"][-1], 0.8 * 0.5 * stops * 0.1, rtol=0, atol=way)
    np.testing.assert_allclose(found["across"][-1], 0.6 * 0.5 * stops * 0.1, rtol=0, atol=way)
    rests = found["time"].to_numpy() > stops + 0.2
    assert float(np.max(np.linalg.norm(found["v_WB"][rests], axis=-1))) <= speed


@pytest.mark.parametrize(
    "engine", ["mujoco[formulation=chart]", "mujoco[formulation=free]", "pinocchio[formulation=contact]"]
)
def test_a_slope_that_holds(engine: str) -> None:
    """Where resistance is stronger than gravity along the slope a ball that rolls up stops for good, without creep."""
    scene = load_scene("inclined_plane", tilt=-0.05, speed=0.1, cross_speed=0.0, rolling_resistance=2e-3)
    found = simulate(scene, engine, until=0.6, every=0.1)
    assert abs(float(found["down"][-1] - found["down"][-2])) < 1e-9
    assert float(found["down"][-1]) > 0
