"""Gravity, which all elements of a scene share."""

import math
from dataclasses import dataclass, field

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.bounds import require_bounds


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity.

    Attributes:
        magnitude: acceleration [m/s^2].
        direction: in the world, of any length.
    """

    magnitude: float = field(metadata={"unit": "m/s^2"})
    direction: tuple[float, float, float] = field(default=(0.0, 0.0, -1.0), metadata={"unit": "1"})

    def __post_init__(self) -> None:
        """Refuses a negative magnitude, and a direction without length."""
        require_bounds("magnitude", self.magnitude, at_least=0)
        for value in self.direction:
            require_bounds("direction", value)
        require_bounds("length of direction", math.hypot(*self.direction), above=0)

    @property
    def vector(self) -> FloatArray:
        """Acceleration of gravity in the world [m/s²], shape (3,)."""
        direction = np.asarray(self.direction, dtype=np.float64)
        return np.asarray(self.magnitude * direction / np.linalg.norm(direction))
