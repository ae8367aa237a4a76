"""Curves by name."""

from __future__ import annotations

import math

import numpy as np
import pytest
from placed_balls import of_ball

from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.figures.quantities import euler_angles, known, quantity
from proofroll.papers.blajer_2006.projection.orientation import EulerAngles


def test_euler_angles_come_back_over_many_turns() -> None:
    """The quaternion of φ, θ, ψ gives them again, with φ and ψ running on for turns and starting where they did."""
    t = np.linspace(0.0, 1.0, 400)
    phi, theta, psi = 0.4 * np.sin(30 * t) - 9.0 * t, math.pi / 2 + 0.9 * np.sin(20 * t), -160.0 * t
    at = np.stack([phi, theta, psi], axis=1)
    q_WB = np.array([EulerAngles().quaternion(angles) for angles in at])
    found = euler_angles(q_WB, at[0].tolist())
    for said, true in zip(found, (psi, theta, phi), strict=True):
        assert said == pytest.approx(true, abs=1e-9)


@pytest.mark.drill
def test_every_known_quantity_has_values_or_is_the_engines_to_tell() -> None:
    """All but the Euler angles follow from the truth's trajectory, in the order of its samples."""
    scene = load_scene("sphere_in_cylinder")
    dataset = of_ball(truth(scene, np.linspace(0.0, 0.2, 5)))
    missing = []
    for name in known(rolling_ball(scene)):
        values = quantity(name, rolling_ball(scene), dataset, (0.0, math.pi / 2, 0.0))
        if values is None:
            missing.append(name)
        else:
            assert values.shape == (5,)
    assert missing == ["psi", "theta", "phi"]
