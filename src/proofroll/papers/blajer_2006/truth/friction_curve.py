"""Friction needed to roll without slip, over time, with its peaks: the staircase of slip onset.

While the ball sticks its motion does not depend on μ. One integration of rolling without slip therefore gives the first
slip for every μ: the time when n(t) = |F|/N first reaches μ. When μ grows past a peak of n that exceeds all earlier
ones, the onset jumps to a later rise: each such peak is an edge of the staircase.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from proofroll.core.arrays import FloatArray
from proofroll.core.event_location import first_rise
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.polar import first_route

_UNREACHABLE = 1e6  # a static friction that stands for rolling without slip; its square is still finite
_POINTS = 12
_SAME = 1e-10  # relative difference below which two peaks are equal


@dataclass(frozen=True)
class FrictionCurve:
    """Needed friction |F|/N [1] of rolling without slip.

    Attributes:
        until: last known time [s]; earlier than requested where the normal force vanishes.
        times, values: on a grid with at most one peak per interval, shape (n,).
        crest_times, crest_values: local maxima between the ends, shape (k,).
    """

    until: float
    times: FloatArray
    values: FloatArray
    crest_times: FloatArray
    crest_values: FloatArray
    _needed: Callable[[FloatArray], FloatArray]

    def __call__(self, times: FloatArray) -> FloatArray:
        """Needed friction at times between 0 and ``until`` [s], shape (m,)."""
        return self._needed(np.asarray(times, dtype=np.float64))

    def slope(self, time: float) -> float:
        """Time derivative of the needed friction [1/s]."""
        span = 1e-2 * (self.times[1] - self.times[0])
        low, high = max(time - span, 0.0), min(time + span, self.until)
        x = np.cos(np.pi * np.arange(5) / 4)
        fit = np.polynomial.Chebyshev.fit(nodes := _spread(low, high, x), self(nodes), 4)
        return float(fit.deriv()(time))

    def onset(self, mu: float) -> float | None:
        """Time at which the needed friction first reaches ``mu`` [s]; None: not until ``until``."""
        if self.values[0] > mu:
            return 0.0
        times = np.concatenate([self.times, self.crest_times])
        order = np.argsort(times)
        times, values = times[order], np.concatenate([self.values, self.crest_values])[order]
        above = np.flatnonzero(values > mu)
        if not len(above):
            return None
        index = int(above[0])
        start, end = float(times[index - 1]), float(times[index])
        rise = first_rise(lambda t: self(t) - mu, start, end)
        return end if rise is None else rise

    def edges(self) -> FloatArray:
        """Values of μ at which the onset jumps, rising: the peaks that exceed all earlier values."""
        values = np.concatenate([self.values[:1], self.crest_values])
        return values[1:][values[1:] > (1 + _SAME) * np.maximum.accumulate(values)[:-1]]

    def rises_before(self, time: float) -> int:
        """Number of peaks before a time [s]: the index of the stair of an onset at that time."""
        return int(np.searchsorted(self.crest_times, time))


def friction_curve(body: RollingBall, until: float) -> FrictionCurve:
    """Needed friction from time 0 to ``until`` [s]; independent of the scene's own μ."""
    endless = body.with_contact(mu_static=_UNREACHABLE, mu_kinetic=_UNREACHABLE)
    route = first_route(endless)
    end, motion_at = route.rolling(until)
    # One sample per radian of rolling: peaks follow the scale of the path, many radians apart.
    pace = body.ball.radius / (np.linalg.norm(body.v0) + np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)))
    times = np.linspace(0.0, end, max(int(np.ceil(end / pace)), 4) + 1)

    def needed(times: FloatArray) -> FloatArray:
        motion = motion_at(times)
        e1 = body.surface.normal(motion.p_WB)
        N = -np.sum(motion.force * e1, axis=-1)
        return np.asarray(np.linalg.norm(motion.force + N[:, None] * e1, axis=-1) / N)

    values = needed(times)
    peaks = np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] > values[2:])) + 1
    crests = [_crest(needed, float(times[i - 1]), float(times[i + 1])) for i in peaks]
    return FrictionCurve(
        until=end,
        times=times,
        values=values,
        crest_times=np.array([time for time, _ in crests]),
        crest_values=np.array([value for _, value in crests]),
        _needed=needed,
    )


def _spread(low: float, high: float, x: FloatArray) -> FloatArray:
    return np.asarray((low + high) / 2 + (high - low) / 2 * x)


def _crest(needed: Callable[[FloatArray], FloatArray], low: float, high: float) -> tuple[float, float]:
    """Time [s] and value of the only peak between two times, from a polynomial through Chebyshev points."""
    x = chebyshev.chebpts2(_POINTS)
    fit = chebyshev.chebfit(x, needed(_spread(low, high, x)), _POINTS - 1)
    roots = chebyshev.chebroots(chebyshev.chebder(fit))
    inner = np.real(roots[(np.abs(np.imag(roots)) < 1e-9) & (np.abs(np.real(roots)) <= 1)])
    best = max(inner, key=lambda r: float(chebyshev.chebval(r, fit)), default=0.0)
    return float(_spread(low, high, np.array([best]))[0]), float(chebyshev.chebval(best, fit))
