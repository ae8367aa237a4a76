"""Forces of Exudyn's formulation generic, written out as one expression."""

import math

import numpy as np
import pytest

from proofroll.elements.ball_on_surface.as_body import rolling_ball
from proofroll.engines.exudyn.ball.generic_forces import base, force_function, quadratic_terms
from proofroll.engines.exudyn.ball.local_frame import local_geometry, slow
from proofroll.files.scene_file import load_scene

pytest.importorskip("exudyn")


@pytest.mark.parametrize("f", [0.0, 1e-3])
@pytest.mark.parametrize("speed", [1.0, 1e-4, 0.0])
def test_forces_are_weight_inertia_and_resistance(f, speed):
    """The written-out expression is the sum over its terms and the moment of the rolling resistance."""
    body = rolling_ball(load_scene("sphere_in_cylinder", rolling_resistance=f))
    local = local_geometry(body.surface)
    q, rates = [0.0, 0.3, 0.2, 0.1, 0.2, 0.3], [speed * x for x in (0.1, 0.7, -0.4, 2.0, -3.0, 5.0)]
    weight = body.ball.mass * base(local).T @ body.surface.frame(body.u0).T @ body.gravity
    expected = [*weight.tolist(), 0.0, 0.0, 0.0]
    for row, i, j, factor in quadratic_terms(body, local):
        expected[row] += factor * rates[i] * rates[j]
    v = local.tangents[1:] @ rates[1:3]
    lever = f * expected[0] / max(float(np.hypot(*v)), slow(body))
    expected[4:] = [expected[4] - lever * v[1], expected[5] + lever * v[0]]
    found = force_function(body, local)(None, 0.0, 0, q, rates)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13 * max(map(math.fabs, expected)))
