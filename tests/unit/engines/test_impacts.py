"""Restitution in the engines that can be asked for it."""

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
        ("pinocchio[formulation=contact]", 1e-2),
        ("pinocchio[formulation=contact,preset=default]", 1e-2),
        ("exudyn[formulation=contact]", 5e-3),
        ("exudyn[formulation=contact,preset=default]", 1e-2),
        ("mujoco[formulation=free]", 1e-2),
        ("mujoco[formulation=free,dt=1e-4]", 1e-3),
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
        ("projection", "impacts on the wall"),
        ("exudyn[formulation=generic]", "choose formulation=contact"),
        ("mujoco[formulation=chart]", "choose formulation=free"),
        ("mujoco[formulation=free,preset=tuned]", "integrator=Euler"),
        ("pinocchio[formulation=free_flyer]", "choose formulation=contact"),
    ],
)
def test_who_cannot_let_a_ball_land_says_so(engine: str, said: str) -> None:
    """A formulation without restitution refuses, and says what to take or why."""
    with pytest.raises(Refused, match=said):
        simulate(load_scene("bouncing_ball"), engine, until=0.1, every=0.05)


@pytest.mark.parametrize("e", [0.0, 1.0])
def test_dead_and_perfect_impacts(e: float) -> None:
    """With e = 0 the ball stays where it lands, with 1 it comes back to its height, in Exudyn's contact as in truth."""
    scene = load_scene("bouncing_ball", restitution=e, height=0.3)
    true, found = (simulate(scene, name, until=0.6, every=0.02) for name in ("truth", "exudyn[formulation=contact]"))
    np.testing.assert_allclose(found["gap"], true["gap"], rtol=0, atol=2e-3)
