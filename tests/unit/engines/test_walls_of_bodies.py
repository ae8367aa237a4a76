"""A ball written as a body with a sphere on a wall, in the general contact formulations of the engines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair

RADIUS, MASS, SHARE = 0.025, 0.5, 0.4  # m, kg, J / (m a²)
MOMENT = SHARE * MASS * RADIUS**2
GRAVITY = 9.81


def ball_in_bore(*, friction: float = math.inf, speed: float = 4.0) -> Mechanism:
    """A ball that rolls round in a vertical bore, in which its centre has a circle of 0.2 m."""
    joint = Joint("free", "free", "world", "ball", q0=(0.2, 0, 0, 1, 0, 0, 0), v0=(0, speed, 0, 0, 0, -speed / RADIUS))
    shapes = (
        Geometry("sphere", "ball", "sphere", radius=RADIUS),
        Geometry("wall", "world", "bore", radius=0.2 + RADIUS),
    )
    pairs = (Pair("contact", ("sphere", "wall"), friction),)
    return Mechanism((Body("ball", MASS, inertia=(MOMENT,) * 3),), (joint,), geometries=shapes, pairs=pairs)


def place_in_bore(t: float, speed: float = 4.0) -> np.ndarray:
    """Centre of that ball [m] where it never slips: round at a constant rate, up and down as an oscillator."""
    rate = speed / 0.2
    drop = GRAVITY / (SHARE * rate**2) * (1 - math.cos(math.sqrt(SHARE / (1 + SHARE)) * rate * t))
    return np.array([0.2 * math.cos(rate * t), 0.2 * math.sin(rate * t), -drop])


def leaning_wheel(friction: float) -> Mechanism:
    """A thin wheel that rolls and leans on a plane."""
    joint = Joint("f", "free", "world", "wheel", q0=(0, 0, 0.3, 1, 0, 0, 0), v0=(1.5, -0.3, 0, 1, 5, 0))
    shapes = (Geometry("ground", "world", "plane"), Geometry("rim", "wheel", "circle", radius=0.3, normal=(0, 1, 0)))
    pairs = (Pair("touch", ("rim", "ground"), friction),)
    return Mechanism((Body("wheel", 2.0, inertia=(0.12, 0.06, 0.12)),), (joint,), geometries=shapes, pairs=pairs)


@pytest.mark.parametrize("friction", [math.inf, 100.0, 5.0])
@pytest.mark.parametrize("preset", ["default", "matched", "tuned"])
def test_impulses_hold_a_ball_by_any_friction(friction: float, preset: str) -> None:
    """A cone wider than rolling needs, however wide, leaves the path at the first order of its steps."""
    pinocchio = load_engine("pinocchio")
    off = []
    for dt in (1e-3, 5e-4):
        run = pinocchio.build(ball_in_bore(friction=friction), replace(pinocchio.presets["impulses"][preset], dt=dt))
        run.advance(0.2)
        off.append(float(np.linalg.norm(run.sample().p_WB[0] - place_in_bore(0.2))))
    assert 5e-4 < off[0] < 1.5e-3  # m, about 1 m/s times the step
    assert 1.8 < off[0] / off[1] < 2.5


@pytest.mark.parametrize("friction", [math.inf, 100.0])
def test_impulses_hold_a_wheel_by_any_friction(friction: float) -> None:
    """A wheel whose contact gives way unequally rolls with any friction as with one that is just enough."""
    pinocchio = load_engine("pinocchio")
    wide, enough = (
        pinocchio.build(leaning_wheel(mu), pinocchio.presets["impulses"]["matched"]) for mu in (friction, 0.5)
    )
    for run in (wide, enough):
        run.advance(0.3)
    # both are found to 1e-8 of impulses that add up to some m/s
    np.testing.assert_allclose(wide.sample().p_WB, enough.sample().p_WB, rtol=0, atol=1e-7)
