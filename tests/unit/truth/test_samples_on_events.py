"""Samples on an event: both routes give the value after it, so that no bar counts the jump."""

import numpy as np
import pytest

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.switched_truth import truth_of

DOWN = np.array([-0.37208365159161944, -0.3438637275758072, -0.8621551444351054])


@pytest.mark.parametrize("last_digits", [-3, -1, 0, 1, 3])
def test_a_sample_on_an_impact_has_the_velocity_after_it(last_digits: int) -> None:
    """A ball that rebounds by half on a turned floor is known as well there as anywhere else."""
    start = tuple((-0.3 * DOWN).tolist())  # 0.2 m above the floor: it hits after 0.2 s
    ball = Body("ball", 1.0, inertia=(0.004, 0.004, 0.004))
    joint = Joint("free", "free", "world", "ball", q0=(*start, 1.0, 0.0, 0.0, 0.0))
    normal = tuple((-DOWN).tolist())
    shapes = (Geometry("floor", "world", "plane", normal=normal), Geometry("skin", "ball", "sphere", radius=0.1))
    pairs = (Pair("touch", ("skin", "floor"), friction=0.3, restitution=0.5),)
    mechanism = Mechanism((ball,), (joint,), geometries=shapes, pairs=pairs, gravity=tuple((10 * DOWN).tolist()))
    (event,) = truth_of(mechanism, np.array([0.0, 0.3])).events
    sample = event.time + last_digits * float(np.spacing(event.time))
    found = truth_of(mechanism, np.array([0.0, sample, 0.3]))
    assert found.record.v_WB[1, 0] == pytest.approx(-DOWN, abs=1e-13)
    assert found.bars["v_WB"][-1] < 1e-12
