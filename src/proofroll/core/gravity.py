"""Gravity, which all elements of a scene share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity: magnitude [m/s²] and direction (any length)."""

    magnitude: float
    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)

    @property
    def vector(self) -> FloatArray:
        """Acceleration of gravity in the world [m/s²], shape (3,)."""
        direction = np.asarray(self.direction, dtype=np.float64)
        return np.asarray(self.magnitude * direction / np.linalg.norm(direction))
