"""Servos, limits of efforts and dry friction of PyBullet's joints, and what it has not."""

import numpy as np
import pytest
from proofroll_pybullet.engine import Pybullet

import proofroll
from proofroll.adapter import Refused, require_provided


@pytest.mark.parametrize(
    ("name", "error"), [("servo", 0.02), ("saturated_servo", 0.01), ("spring_friction", 0.01), ("friction_hold", 1e-9)]
)
def test_laws_are_those_of_the_scene(name: str, error: float) -> None:
    """After 0.5 s at a step of 1 ms a mass is where it should be, as far as a first-order step brings it."""
    scene = proofroll.load_scene(name)
    engine = Pybullet.build(scene, Pybullet.presets["urdf"]["matched"])
    engine.advance(0.5)
    truth = proofroll.simulate(scene, until=0.5, every=0.5)
    assert np.max(np.abs(engine.sample().p_WB - truth["p_WB"].to_numpy()[1])) < error


@pytest.mark.parametrize(
    ("name", "reason"), [("arm_pd", "inertia of their own"), ("gear_pair", "gears"), ("stop", "throw")]
)
def test_what_it_has_not_is_refused_with_the_reason(name: str, reason: str) -> None:
    """Armature, couplings and stops are refused before anything is built."""
    with pytest.raises(Refused, match=reason):
        require_provided(Pybullet, "urdf", proofroll.load_scene(name))
