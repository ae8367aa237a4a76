"""Frames that programs report in place of that of a floating base."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.robots.control.base_frames import _principal

TURN = Rotation.from_euler("zyx", [0.02, -0.05, 0.03]).as_matrix()


@pytest.mark.parametrize("moments", [(0.2, 0.2, 0.3), (0.2, 0.3, 0.2), (0.3, 0.2, 0.2), (0.2, 0.2, 0.2)])
def test_axes_of_equal_moments_are_the_given_ones(moments: tuple[float, float, float]) -> None:
    """Round-off in an inertia with equal principal moments turns no axis."""
    for place in ((0, 1), (0, 2), (1, 2)):
        inertia = np.diag(moments)
        inertia[place] = inertia[place[::-1]] = 1e-15
        assert _principal(inertia, np.eye(3)) == pytest.approx(np.eye(3), abs=1e-12)


def test_axes_in_a_plane_of_equal_moments_turn_least() -> None:
    """Axes in the plane of two equal moments, and that across it, turn as little as that plane."""
    inertia = TURN @ np.diag([0.2, 0.2, 0.3]) @ TURN.T
    axes = _principal(inertia, np.eye(3))
    assert axes @ np.diag([0.2, 0.2, 0.3]) @ axes.T == pytest.approx(inertia, abs=1e-15)
    angle = Rotation.from_matrix(axes).magnitude()
    assert angle == pytest.approx(np.arccos(TURN[2, 2]), rel=1e-6)
