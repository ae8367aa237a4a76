"""Scales of runs and steps: natural time and first motion of a ball, dimensionless numbers of a step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element import FirstMotion, StepNumber
from proofroll.core.time_grid import EVERY
from proofroll.core.whole_turns import PART as PART_OF_TURNS
from proofroll.elements.ball_on_surface.mechanics import (
    initial_angular_acceleration,
    initial_response,
    natural_acceleration,
)
from proofroll.elements.ball_on_surface.model import RollingBall

if TYPE_CHECKING:
    import xarray as xr

# Time of the first look at an engine without a step, relative to the time in which its ball rolls by one radius or
# stops.
_PART = 1e-2


def turning_rate(body: RollingBall) -> float:
    """Ω: rate at which the wall's normal turns under the ball at time 0 [rad/s]; V0/c in a cylinder."""
    return float(np.linalg.norm(body.surface.normal_gradient(body.p0) @ body.v0))


def natural_time(body: RollingBall) -> float:
    """Period of the slowest motion that the scene starts with [s].

    Where the path turns at the rate Ω, a ball with r = J/(m a²) oscillates across it at √(r/(1+r)) Ω (√(2/7) Ω for a
    homogeneous ball, Blajer 2006, section 3). On a straight path there is no oscillation: it is one turn of the ball,
    or 2π √(a/g), the time scale of starting to roll, whichever is longer.
    """
    turning, ratio = turning_rate(body), body.ball.inertia_ratio
    if turning > 0:
        return 2 * math.pi / (math.sqrt(ratio / (1 + ratio)) * turning)
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    times = [a / speed] if speed else []
    times += [math.sqrt(a / gravity)] if gravity else []
    return 2 * math.pi * max(times, default=1.0)


def turn_interval(body: RollingBall) -> float | None:
    """See :class:`proofroll.core.element_abilities.CountsTurns`; from the periods of a round and a swing."""
    if not any(body.surface.periods):
        return None
    gravity, bend = float(np.linalg.norm(body.gravity)), float(np.linalg.norm(body.surface.normal_gradient(body.p0), 2))
    swing = 2 * math.pi / math.sqrt(gravity * bend) if gravity * bend else math.inf
    # Round a cylinder a ball runs evenly, however fast.
    return max(EVERY, PART_OF_TURNS * min(natural_time(body), swing))


def step_numbers(body: RollingBall, h: float, truth: xr.Dataset | None) -> tuple[StepNumber, ...]:
    """See :class:`proofroll.core.element.Element`."""
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    fastest = None
    if truth is not None:
        fastest = float(np.max(np.linalg.norm(truth["w_WB"].to_numpy(), axis=-1)))
    return (
        StepNumber("turn", "Ωh", "angle [rad] by which the wall's normal turns in a step", turning_rate(body) * h),
        StepNumber("spin", "(V0/a)h", "angle [rad] by which the ball turns in a step", speed / a * h),
        StepNumber(
            "rotation",
            "h|ω|",
            "angle [rad] by which the ball turns in a step where it turns fastest",
            None if fastest is None else fastest * h,
        ),
        StepNumber("fall", "h√(g/a)", "step in parts of the time of a fall by the radius", math.sqrt(gravity / a) * h),
    )


def first_motion(body: RollingBall) -> FirstMotion:
    """See :class:`proofroll.core.element.Element`."""
    speed = float(np.linalg.norm(body.v0)) or float(np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)))
    acceleration, turning = initial_response(body)[0], initial_angular_acceleration(body)
    lasts = _stops(body.v0, acceleration)
    return FirstMotion(
        acceleration=acceleration[None, :],
        angular_acceleration=turning[None, :],
        scale=natural_acceleration(body),
        moment=_PART * min(body.ball.radius / (speed or 1.0), lasts),
        pull=float(np.linalg.norm(body.gravity)) or None,
        lasts=lasts,
    )


def _stops(velocity: FloatArray, rate: FloatArray) -> float:
    """Time in which a velocity would vanish at its initial rate [s]; infinite where it does not shrink."""
    shrinks = -float(velocity @ rate)
    return float(velocity @ velocity) / shrinks if shrinks > 0 else math.inf
