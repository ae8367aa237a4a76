"""Forces of Exudyn's formulation generic, written out as one expression."""

import math

import numpy as np
import pytest

from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.engines.exudyn.ball.friction import resistance_moment, slow
from proofroll.engines.exudyn.ball.generic_forces import base, force_function, quadratic_terms, weight_function
from proofroll.engines.exudyn.ball.local_frame import local_geometry
from proofroll.files.scene_file import load_scene

pytest.importorskip("exudyn")


@pytest.mark.parametrize(
    ("scene", "parameters"),
    [("sphere_in_cylinder", {"rolling_resistance": 1e-3}), ("tilted_cylinder", {}), ("inclined_plane", {})],
)
@pytest.mark.parametrize("speed", [1.0, 0.0])
def test_forces_are_weight_inertia_and_resistance(scene, parameters, speed):
    """The written-out expression is the sum over its terms and the moment of the rolling resistance."""
    body = rolling_ball(load_scene(scene, **parameters))
    local = local_geometry(body.surface, body.u0)
    q, rates = [0.0, 0.3, 0.2, 0.1, 0.2, 0.3], [speed * x for x in (0.1, 0.7, -0.4, 2.0, -3.0, 5.0)]
    expected = weight_function(body, local, body.ball.mass * base(local))(q)
    for row, i, j, factor in quadratic_terms(body, local):
        expected[row] += factor * rates[i] * rates[j]
    v = local.tangents[1:] @ rates[1:3]
    moment = resistance_moment(body.contact.rolling_resistance, expected[0], *v, slow(body))
    expected[4:] = [expected[4] + moment[0], expected[5] + moment[1]]
    found = force_function(body, local, None)(None, 0.0, 0, q, rates)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13 * max(map(math.fabs, expected)))
