"""By how much the friction that a ball needs exceeds what its contact has."""

from __future__ import annotations

import math
import sys
from typing import Any

from proofroll.core.arrays import FloatArray
from proofroll.engines.pinocchio.ball_with_rows import BallWithRows

# Friction relative to the normal force, and excess of it, that is round-off.
NOISE = 1e-13


def unit(vector: FloatArray) -> FloatArray:
    """The vector made a unit vector; zero stays zero."""
    length = math.sqrt(vector @ vector)
    return vector / length if length > 0 else vector


def excess(mechanism: BallWithRows, data: Any, q: FloatArray, v: FloatArray, mu_static: float) -> tuple[float, float]:
    """(needed - available) / (needed + available) friction while sticking [-], and N [N].

    Slip begins where the first is positive.
    """
    mechanism.accelerate(data, q, v)
    return last_excess(mechanism, data, mu_static)


def last_excess(mechanism: BallWithRows, data: Any, mu_static: float) -> tuple[float, float]:
    """The same at the state of the last :meth:`BallWithRows.accelerate`."""
    needed, normal_force = mechanism.friction_force(data), mechanism.normal_force(data)
    available = mu_static * normal_force
    # A friction of round-off is needed even where none is: it must not count as more than none (mu_static = 0).
    noise = NOISE * abs(normal_force)
    size = max(needed + abs(available) + noise, sys.float_info.min)
    return (needed - available - noise) / size, normal_force
