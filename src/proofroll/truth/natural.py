"""The natural time of a scene: what a run's length and an engine's step are measured by."""

from __future__ import annotations

import math

import numpy as np

from proofroll.core.scene import RollingBall


def turning_rate(body: RollingBall) -> float:
    """Ω: rate at which the wall's normal turns under the ball at time 0 [rad/s]; V0/c in a cylinder."""
    return float(np.linalg.norm(body.surface.normal_gradient(body.p0) @ body.v0))


def natural_time(body: RollingBall) -> float:
    """Period of the slowest motion that the scene starts with [s].

    Where the path turns at the rate Ω, a ball with r = J/(m a²) oscillates across it at √(r/(1+r)) Ω (√(2/7) Ω for a
    homogeneous ball, Blajer 2006, section 3). Where it does not turn, there is no oscillation: one turn of the ball, or
    the time 2π √(a/g) in which it would begin to roll, whichever is longer.
    """
    turning = turning_rate(body)
    if turning > 0:
        ratio = body.ball.inertia_ratio
        return 2 * math.pi / (math.sqrt(ratio / (1 + ratio)) * turning)
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    times = [a / speed] if speed else []
    times += [math.sqrt(a / gravity)] if gravity else []
    return 2 * math.pi * max(times, default=1.0)
