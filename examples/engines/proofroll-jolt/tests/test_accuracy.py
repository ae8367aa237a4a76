"""Accuracy as README.md states it, what Jolt's defaults do, and what is refused."""

import math

import numpy as np
import pytest
from proofroll_jolt.engine import Jolt

import proofroll

DAMPING = 0.05  # 1/s, of all velocities


def off(name, until, dt=1e-3):
    """Largest distance of a tracked place from the truth [m]."""
    scene = proofroll.load_scene(name)
    true = proofroll.simulate(scene, until=until, every=until / 10)["positions"].to_numpy()
    run = proofroll.simulate(scene, Jolt, until=until, every=until / 10, dt=dt)
    return float(np.max(np.abs(run["positions"].to_numpy() - true)))


@pytest.mark.parametrize(
    ("scene", "until", "error"),
    [
        ("pendulum", 0.5, 4.6e-3),
        ("double_pendulum", 0.5, 1.3e-2),
        ("four_bar", 0.5, 6.9e-3),
        ("slider_crank", 0.3, 8.2e-3),
        ("stop", 0.7, 4.0e-3),
        ("stopped_fall", 0.3, 7.6e-4),
    ],
)
def test_errors_are_those_of_the_table(scene, until, error):
    """A place is as far from the truth as the table says at a step of 1 ms, within a third for other processors."""
    assert off(scene, until) == pytest.approx(error, rel=0.35)


def test_a_free_body_loses_its_spin():
    """A body that spins about a principal axis loses 5 % of its spin in a second, at any step."""
    scene = proofroll.load_scene("free_body", w1=0.0, w3=0.0)
    engine = Jolt.build(scene, Jolt.presets["impulse"]["matched"])
    before = np.linalg.norm(engine.sample().w_WB)
    engine.advance(1.0)
    assert np.linalg.norm(engine.sample().w_WB) / before == pytest.approx(math.exp(-DAMPING), rel=1e-3)


def test_shorter_steps_leave_the_damping():
    """The limit of small steps of a pendulum is not the truth: a tenth of the step leaves as much of the error."""
    assert off("pendulum", 0.5, 2.5e-4) > 0.8 * off("pendulum", 0.5)


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        ("free_body", "angular acceleration of the first steps"),
        ("heavy_top", "gyroscopic moment off"),
        ("joint_bench", "universal|spherical"),
        ("pendulum_friction", "no dry friction"),
        ("gear_pair", "no gears"),
        ("servo", "builds no motors"),
        ("falling_rod", "builds no contacts"),
    ],
)
def test_what_it_has_not_is_refused_with_the_reason(scene, reason):
    """Laws that are not built, and what Jolt's defaults change, are refused before a run is believed."""
    with pytest.raises(proofroll.Refused, match=reason):
        proofroll.simulate(proofroll.load_scene(scene), Jolt, until=0.1, every=0.1)


def test_a_body_that_no_box_resembles_is_refused():
    """A body whose moments belong to a plate thinner than culverin's shapes is refused with its moments."""
    from proofroll_jolt.bodies import box

    from proofroll.adapter import Body

    thin = Body(name="plate", mass=1.0, com=np.zeros(3), inertia=np.diag([1e-9, 1e-9, 2e-9]))
    with pytest.raises(proofroll.Refused, match=r"plate: .* no such box has these moments"):
        box(thin)
