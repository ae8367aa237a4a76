"""Whether an inertia can belong to a rigid body."""

from __future__ import annotations

import numpy as np

from proofroll.robots.model import Array

# Round-off of numbers that were written with six or more digits is no defect of a body.
_ROUNDING = 1e-9


def moments(inertia: Array) -> Array:
    """Principal moments, smallest first, shape (3,)."""
    return np.asarray(np.linalg.eigvalsh(inertia), dtype=np.float64)


def not_positive(inertia: Array) -> bool:
    """Whether a principal moment is zero or negative."""
    return bool(moments(inertia)[0] <= 0)


def breaks_triangle(inertia: Array) -> bool:
    """Whether the largest principal moment exceeds the sum of the others by more than round-off."""
    small, middle, large = moments(inertia)
    return bool(large > (small + middle) * (1 + _ROUNDING))
