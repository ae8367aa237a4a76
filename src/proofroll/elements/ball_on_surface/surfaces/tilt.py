"""Surfaces that lean: a rotation about the world's y axis."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from proofroll.core.arrays import FloatArray


@lru_cache
def tilted(angle: float) -> FloatArray:
    """Rotation by ``angle`` [rad] about the world's y axis, read-only, shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    rotation.flags.writeable = False  # every caller shares it
    return rotation


def components(column: FloatArray) -> tuple[float, float, float]:
    """A vector of shape (3,) as plain floats."""
    return (float(column[0]), float(column[1]), float(column[2]))
