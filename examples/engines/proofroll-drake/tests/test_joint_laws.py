"""Servos, limits of efforts, stops, gears and armatures of Drake's joints, and what it has not."""

import numpy as np
import pytest
from proofroll_drake.engine import Drake

import proofroll
from proofroll.adapter import Refused, require_provided


@pytest.mark.parametrize(
    ("name", "error"),
    # without its armatures the arm would be 3 mm elsewhere
    [("servo", 0.02), ("saturated_servo", 0.01), ("stop", 0.01), ("gear_pair", 0.01), ("arm_pd", 1e-3)],
)
def test_laws_are_those_of_the_scene(name: str, error: float) -> None:
    """After 0.5 s at a step of 1 ms a body is where it should be, as far as a first-order step brings it."""
    scene = proofroll.load_scene(name)
    engine = Drake.build(scene, Drake.presets["discrete"]["default"])
    engine.advance(0.5)
    truth = proofroll.simulate(scene, until=0.5, every=0.5)
    found = engine.sample()
    assert np.max(np.abs(found.p_WB - truth["p_WB"].to_numpy()[1])) < error
    for velocity in ("v_WB", "w_WB"):  # bodies turn in the gear and the arm alone
        assert np.max(np.abs(getattr(found, velocity) - truth[velocity].to_numpy()[1])) < 0.02


def test_friction_of_joints_is_refused_with_the_reason() -> None:
    """Drake reads dry friction of joints and leaves it out: that is no scene of it."""
    with pytest.raises(Refused, match="does not use it"):
        require_provided(Drake, "discrete", proofroll.load_scene("spring_friction"))
