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
        fall = np.where(time < impact, -2.0 - 9.81 * time, after - 9.81 * (time - impact))
        return np.stack([0 * time, 0 * time, fall], axis=-1)

    told = ReportedVector("v_WB", "the velocity", "m/s", velocity(0.1 - 1e-9, 2.04), velocity(0.1 + 1e-9, 2.0), time)
    assert not [cause.says for cause in told.causes(1e-3) if cause.id == "late.v_WB"]
