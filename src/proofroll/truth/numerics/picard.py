"""Collocation at Gauss points, solved by Picard's iteration: for smooth rates that are cheap at many states at once.

The order is 2s at the end of a step. Its length is chosen by the decay of the Legendre coefficients of the rates, so
the polynomial is as accurate within a step as at its ends.

Source of the method: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section II.7.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.event_location import points_within

_STAGES = 16
_ITERATIONS = 40  # of Picard at most; a step that needs more is repeated with half its length
_SLOW = 12  # iterations after which one that does not come nearer ends the trial of a length
_SETTLED = 4e-16  # change of an iteration, relative to the scale, that is only round-off
_LEFT_OUT = 1e-15  # last Legendre coefficients, relative to the scale, up to which a step is accepted
# Last Legendre coefficients that are noise if they are alike, and size up to which they can be.
_ALIKE, _NOISE = 4, 1e-13
_ROUND_OFF = 2e-16  # Legendre coefficients, relative to the scale, that are only round-off
# Iterations above which the next step is no longer: they grow with its length. Its length is chosen for so many
# Legendre coefficients above round-off.
_MANY, _AIMED = 20, _STAGES - 2
_SHORTER, _LONGER = 0.2, 4.0  # limits of the change of a step's length
_TRIED = 60  # lengths tried at most for one step
_X = legendre.leggauss(_STAGES)[0]
_TO_LEGENDRE = np.linalg.inv(legendre.legvander(_X, _STAGES - 1))
# Integrals of the Legendre polynomials from -1, as Legendre series: column k is that of polynomial k.
_INTEGRAL = np.stack([legendre.legint(row, lbnd=-1) for row in np.eye(_STAGES)], axis=-1)
# Of values at the nodes in rows: integrals up to the nodes, and over the step; Legendre series, and of the integral.
_TO_NODES = np.ascontiguousarray((legendre.legvander(_X, _STAGES) @ _INTEGRAL @ _TO_LEGENDRE).T)
_TO_END = legendre.legvander(np.ones(1), _STAGES)[0] @ _INTEGRAL @ _TO_LEGENDRE
_TO_SERIES, _TO_COEFFICIENTS = (_INTEGRAL @ _TO_LEGENDRE).T, _TO_LEGENDRE.T
_AT_POINTS = legendre.legvander(points_within(-1.0, 1.0), _STAGES).T

Rates = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class StatesInside:
    """States within a step, from its first state, start [s], length [s] and Legendre series, shape (n, degrees)."""

    state: FloatArray
    start: float
    length: float
    series: FloatArray

    def __call__(self, times: FloatArray) -> FloatArray:
        """States at times [s], shape (n, times)."""
        x = 2 * (np.asarray(times) - self.start) / self.length - 1
        return np.asarray(self.state[:, None] + self.series @ legendre.legvander(x, _STAGES).T)

    def at_points(self) -> FloatArray:
        """States at :func:`proofroll.core.event_location.points_within` of the step, shape (n, points)."""
        return np.asarray(self.state[:, None] + self.series @ _AT_POINTS)


class PicardSteps:
    """Steps of one integration of autonomous equations: (n, states) -> (n, states) are their rates."""

    def __init__(self, rates: Rates) -> None:
        self._rates = rates
        self._length: float | None = None

    def step(self, time: float, state: FloatArray, until: float) -> tuple[float, FloatArray, StatesInside]:
        """End [s] and state of a step from a time and state, and states at times within.

        Raises:
            Diverged: no length is short enough.
        """
        scale = np.maximum(1.0, np.abs(state))[:, None]
        rates = self._rates(state[:, None])
        # first some part of the time in which the state changes by its scale
        length = self._length or 0.1 / max(float(np.max(np.abs(rates) / scale)), 1e-3)
        for _ in range(_TRIED):
            length = min(length, until - time)
            end = until if length == until - time else time + length
            values, error, longer = self._solved(state[:, None], rates, scale, length)
            if error <= _LEFT_OUT:
                if end < until or self._length is None:
                    self._length = length * longer
                series = length / 2 * (values @ _TO_SERIES)
                return end, state + length / 2 * (values @ _TO_END), StatesInside(state, time, length, series)
            length *= min(longer, 0.9)
            if time + length <= time:
                break
        raise Diverged(f"the step size fell to nothing at t = {time:.6g} s")

    def _solved(
        self, state: FloatArray, rates: FloatArray, scale: FloatArray, length: float
    ) -> tuple[FloatArray, float, float]:
        """Rates at the nodes of a step, the relative size of what its polynomial leaves out, and change of the length.

        That size is inf if there is no solution.
        """
        last_change, least = np.inf, np.inf
        states = state + length / 2 * (np.repeat(rates, _STAGES, axis=1) @ _TO_NODES)
        for count in range(_ITERATIONS):
            values = self._rates(states)
            if not np.isfinite(values).all():
                break
            moved = state + length / 2 * (values @ _TO_NODES)
            change = float((np.abs(moved - states) / scale).max())
            states = moved
            if change <= _SETTLED or (change < 1e-13 and change > 0.5 * last_change):
                sizes = (np.abs(values @ _TO_COEFFICIENTS) * length / scale).max(axis=0)
                return self._rates(states), *_left_out(sizes, count)
            if count > _SLOW and change > least:
                break
            last_change, least = change, min(least, change)
        return values, np.inf, 0.5


def _left_out(sizes: FloatArray, count: int) -> tuple[float, float]:
    """Size of what a polynomial leaves out, and change of a step's length after which as much as allowed is left out.

    The last coefficients are noise, and say nothing on what is left out, where several of them are alike. Otherwise the
    coefficient of degree k is proportional to the k-th power of the length.

    Args:
        sizes: of the Legendre coefficients, relative to the scale.
        count: iterations that the step has taken.
    """
    last = float(sizes[-2:].max())
    noise = max(_ROUND_OFF, 2 * last)
    degree = max(int(np.flatnonzero(sizes > noise).max(initial=0)), 1)
    alike = degree < len(sizes) - _ALIKE and noise < _NOISE
    if alike or last <= _LEFT_OUT:
        change = 10 ** (np.log10(noise) / _AIMED - np.log10(noise) / (degree + 1))
    else:
        change = 0.9 * (_ROUND_OFF / last) ** (1 / len(sizes))
    change = float(np.clip(min(change, 1.0) if count > _MANY else change, _SHORTER, _LONGER))
    return 0.0 if alike else last, change
