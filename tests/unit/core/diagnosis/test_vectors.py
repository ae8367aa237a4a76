"""Causes of a vector that is reported otherwise."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.diagnosis.vectors import ReportedVector


def test_a_frame_that_fits_by_chance_hides_no_exact_cause() -> None:
    """Where axes of a body are nearly the world's with x and y swapped, swapped vectors are said to be just that."""
    angles = np.linspace(0.0, 2.0, 21)
    true = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    frame = Rotation.from_rotvec(np.outer(2 * angles - np.pi / 2 + 0.03, [0, 0, 1])).as_matrix()
    told = ReportedVector("v_WB", "the velocity", "m/s", true[:, [1, 0, 2]], true, angles, {"body axes": frame})
    proven = [cause for cause in told.causes(None) if cause.proven]
    best = min(proven, key=lambda cause: cause.left)
    assert any("in body axes" in cause.says for cause in proven)  # within a twentieth
    assert "other axes or signs: its x, y, z are the true y, x" in best.says


def test_a_sample_on_the_other_side_of_an_impact_is_no_delay() -> None:
    """A velocity that an impact takes a step early, and that is 2 % off after it, is not said to be early."""
    time = np.linspace(0.0, 0.3, 31)

    def velocity(impact: float, after: float) -> np.ndarray:
        return np.outer(np.where(time < impact, 1.0, -after), [2.0, 0.3, -0.2])

    reported, true = velocity(0.1 - 1e-9, 0.98), velocity(0.1 + 1e-9, 1.0)
    told = ReportedVector("v_WB", "the velocity", "m/s", reported, true, time)
    assert not [cause.says for cause in told.causes(1e-3) if cause.id == "late.v_WB"]
