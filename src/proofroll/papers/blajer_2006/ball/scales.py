"""Natural time and dimensionless numbers of a step of a ball that rolls in an upright cylinder."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.element import StepNumber

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall


def _turning_rate(body: BodyOnWall) -> float:
    """Ω: rate at which the wall's normal turns under the ball at time 0 [rad/s]; V0/c in a cylinder."""
    return float(np.linalg.norm(body.surface.normal_gradient(body.surface.position(body.u0)) @ body.v0))


def natural_time(body: BodyOnWall) -> float:
    """Period of the slowest motion that the ball starts with [s].

    Where the path turns at the rate Ω, a ball with r = J/(m a²) oscillates across it at √(r/(1+r)) Ω (√(2/7) Ω for a
    homogeneous ball, Blajer 2006, section 3). On a straight path there is no oscillation: it is one turn of the ball,
    or 2π √(a/g), the time scale of starting to roll, whichever is longer.
    """
    turning, ratio = _turning_rate(body), body.ball.inertia_ratio
    if turning > 0:
        return 2 * math.pi / (math.sqrt(ratio / (1 + ratio)) * turning)
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    times = [a / speed] if speed else []
    times += [math.sqrt(a / gravity)] if gravity else []
    return 2 * math.pi * max(times, default=1.0)


def step_numbers(body: BodyOnWall, h: float, truth: xr.Dataset | None) -> tuple[StepNumber, ...]:
    """See :class:`proofroll.core.element.Element`."""
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    fastest = None
    if truth is not None:
        fastest = float(np.max(np.linalg.norm(truth["w_WB"].to_numpy(), axis=-1)))
    return (
        StepNumber("turn", "Ωh", "angle [rad] by which the wall's normal turns in a step", _turning_rate(body) * h),
        StepNumber("spin", "(V0/a)h", "angle [rad] by which the ball turns in a step", speed / a * h),
        StepNumber(
            "rotation",
            "h|ω|",
            "angle [rad] by which the ball turns in a step where it turns fastest",
            None if fastest is None else fastest * h,
        ),
        StepNumber("fall", "h√(g/a)", "step in parts of the time of a fall by the radius", math.sqrt(gravity / a) * h),
    )
