"""The moment of the rolling resistance as all formulations here apply it."""

from __future__ import annotations

import math


def resistance_moment(f: float, N: float, v2: float, v3: float) -> tuple[float, float]:
    """Moment about the centre along e2 and e3 [N m]: that of -N e1 shifted by ``f`` [m] along the velocity [m/s].

    :func:`mechanics.resistance_moment` in the local frame and as plain floats: it runs for every residual.
    """
    speed = math.hypot(v2, v3)
    if not speed:
        return 0.0, 0.0
    factor = f * N / speed
    return -factor * v3, factor * v2
