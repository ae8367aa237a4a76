"""The moment of the rolling resistance as all formulations here apply it."""

from __future__ import annotations

import math

import numpy as np

from proofroll.elements.ball_on_surface.model import RollingBall

# Part of the speed of a fall by the radius below which the moment falls to zero with the speed: Newton's method does
# not pass the jump of its direction at rest. A ball that stops from that speed goes the square of it, 4e-6, too far.
_AT_REST = 2e-3


def slow(body: RollingBall) -> float:
    """Speed of the centre [m/s] below which the rolling resistance grows with it."""
    return _AT_REST * math.sqrt(body.ball.radius * float(np.linalg.norm(body.gravity)))


def resistance_moment(f: float, N: float, v2: float, v3: float, slow: float) -> tuple[float, float]:
    """Moment about the centre along e2 and e3 [N m]: that of -N e1 shifted by ``f`` [m] along the velocity [m/s].

    :func:`mechanics.resistance_moment` in the local frame and as plain floats: it runs for every residual. For ``slow``
    see there.
    """
    speed = max(math.hypot(v2, v3), slow)
    if not speed:
        return 0.0, 0.0
    factor = f * N / speed
    return -factor * v3, factor * v2
