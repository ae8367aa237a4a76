"""Restitution of a ball in the engines that can be asked for it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.core.errors import Refused
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

BOUNCES = load_scene("bouncing_ball", restitution=0.6, height=0.3)  # rests after 0.99 s


@pytest.fixture(scope="module")
def true() -> xr.Dataset:
    """Its truth."""
    return simulate(BOUNCES, "truth", until=1.2, every=0.02)


@pytest.mark.parametrize(
    ("engine", "off"),
    [
        pytest.param("projection[formulation=dependent]", 1e-12, marks=pytest.mark.drill),
        ("pinocchio[formulation=impulses]", 1e-2),
        ("mujoco[formulation=geoms]", 1e-2),
        ("mujoco[formulation=geoms,dt=1e-4]", 1e-3),
    ],
)
def test_height_after_each_impact(engine: str, off: float, true: xr.Dataset) -> None:
    """The ball is where the truth says in the first flights, to what a step leaves, and rests in the end."""
    found = simulate(BOUNCES, engine, until=1.2, every=0.02)
    np.testing.assert_allclose(found["gap"], true["gap"], rtol=0, atol=off)
    assert float(np.max(np.abs(found["v_WB"][-5:]))) < 1e-3


@pytest.mark.parametrize(
    ("engine", "said"),
    [
        ("exudyn[formulation=spheres]", "ever shorter steps alone"),
        ("mujoco[formulation=geoms,preset=default]", "cone=elliptic"),
        ("mujoco[formulation=geoms,preset=tuned]", "integrator=Euler"),
    ],
)
def test_who_cannot_let_a_ball_land_says_so(engine: str, said: str) -> None:
    """Settings without restitution are refused, with what to take or why."""
    with pytest.raises(Refused, match=said):
        simulate(load_scene("bouncing_ball"), engine, until=0.1, every=0.05)


@pytest.mark.parametrize("e", [0.0, 1.0])
def test_dead_and_perfect_impacts(e: float) -> None:
    """With e = 0 the ball stays where it lands, with 1 it comes back to its height, in impulses as in truth."""
    scene = load_scene("bouncing_ball", restitution=e, height=0.3)
    true, found = (
        simulate(scene, name, until=0.6, every=0.02) for name in ("truth", "pinocchio[formulation=impulses]")
    )
    np.testing.assert_allclose(found["gap"], true["gap"], rtol=0, atol=5e-3)
