"""Equations of motion of a mechanism in the coordinates of its tree."""

import numpy as np
import pytest

from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.files.scene_file import load_scene


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "name", ["double_pendulum", "heavy_top", "four_bar", "bricard", "andrews_squeezer", "gear_pair", "driven_four_bar"]
)
def test_recorded_terms_are_those_of_numpy(name: str) -> None:
    """Accelerations, multipliers, motion and rows at random states are equal to the last digits, recorded or not."""
    mechanism = mechanism_of(load_scene(name))
    plain, recorded = JointCoordinates(mechanism), JointCoordinates(mechanism)
    recorded.record()
    random = np.random.default_rng(0)
    for _ in range(5):
        q, v = mechanism.start()
        q = plain.tree.moved(q, 0.1 * random.standard_normal(len(v)))
        v = v + random.standard_normal(len(v))
        one, other = plain.solve(q, v, time=0.3), recorded.solve(q, v, time=0.3)
        for found, known in [
            (other.acceleration, one.acceleration),
            (other.multipliers, one.multipliers),
            (other.motion.J, one.motion.J),
            (other.motion.bias, one.motion.bias),
            (other.motion.R_WB, one.motion.R_WB),
            (other.rows.residual, one.rows.residual),
            (other.rows.torque, one.rows.torque),
        ]:
            scale = 1 + np.abs(known).max(initial=0.0)
            assert np.abs(found - known).max(initial=0.0) < 1e-11 * scale
        assert other.rows.loop.tolist() == one.rows.loop.tolist()
