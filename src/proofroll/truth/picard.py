"""Collocation at Gauss points, solved by Picard's iteration: for smooth rates that are cheap at many states at once.

The order is 2s at the end of a step. Its length is chosen by the decay of the Legendre coefficients of the rates, so
the polynomial is as accurate within a step as at its ends.

Source of the method: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section II.7.
"""

from collections.abc import Callable

import numpy as np
from numpy.polynomial import legendre

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged

_STAGES = 16
_ITERATIONS = 40  # of Picard at most; a step that needs more is repeated with half its length
_SETTLED = 4e-16  # change of an iteration, relative to the scale, that is only round-off
_LEFT_OUT = 1e-15  # last Legendre coefficients, relative to the scale, up to which a step is accepted
_ROUND_OFF = 1e-16  # last Legendre coefficients, relative to the scale, that say no more than that the step may grow
_SHORTER, _LONGER = 0.2, 2.0  # limits of the change of a step's length
_TRIED = 60  # lengths tried at most for one step
_X = legendre.leggauss(_STAGES)[0]
_TO_LEGENDRE = np.linalg.inv(legendre.legvander(_X, _STAGES - 1))
# Integrals of the Legendre polynomials from -1, as Legendre series: column k is that of polynomial k.
_INTEGRAL = np.stack([legendre.legint(row, lbnd=-1) for row in np.eye(_STAGES)], axis=-1)
_TO_NODES = legendre.legvander(_X, _STAGES) @ _INTEGRAL @ _TO_LEGENDRE
_TO_END = legendre.legvander(np.ones(1), _STAGES)[0] @ _INTEGRAL @ _TO_LEGENDRE

Rates = Callable[[FloatArray], FloatArray]
Inside = Callable[[FloatArray], FloatArray]


class PicardSteps:
    """Steps of one integration of autonomous equations: (states, n) -> (states, n) are their rates."""

    def __init__(self, rates: Rates) -> None:
        self._rates = rates
        self._length: float | None = None
        self._series: FloatArray | None = None

    def step(self, time: float, state: FloatArray, until: float) -> tuple[float, FloatArray, Inside]:
        """End [s] and state of a step from a time and state, and states at times within, (times) -> (times, n).

        Raises:
            Diverged: no length is short enough.
        """
        scale = np.maximum(1.0, np.abs(state))
        first = self._rates(state[None])[0]
        length = self._length or _first_length(first, scale)
        for _ in range(_TRIED):
            length = min(length, until - time)
            end = until if length == until - time else time + length
            values, error = self._solved(state, first, scale, length)
            factor = _LONGER if error < _ROUND_OFF else 0.9 * (_LEFT_OUT / error) ** (1 / _STAGES)
            if error <= _LEFT_OUT:
                if end < until or self._length is None:
                    self._length = length * float(np.clip(factor, _SHORTER, _LONGER))
                series = length / 2 * _INTEGRAL @ (_TO_LEGENDRE @ values)
                return end, state + length / 2 * (_TO_END @ values), _inside(state, time, length, series)
            length *= float(np.clip(factor, _SHORTER, 0.9))
            if time + length <= time:
                break
        raise Diverged(f"the step size fell to nothing at t = {time:.6g} s")

    def _solved(
        self, state: FloatArray, first: FloatArray, scale: FloatArray, length: float
    ) -> tuple[FloatArray, float]:
        """Rates at the nodes of a step, and the relative size of what its polynomial leaves out; inf: no solution."""
        values, before = np.broadcast_to(first, (_STAGES, len(first))), np.inf
        states = state + length / 2 * (_TO_NODES @ values)
        for _ in range(_ITERATIONS):
            values = self._rates(states)
            moved = state + length / 2 * (_TO_NODES @ values)
            change = float(np.max(np.abs(moved - states) / scale))
            states = moved
            if not change < np.inf:
                break
            if change <= _SETTLED or (change < 1e-13 and change > 0.5 * before):
                last = np.abs(length * (_TO_LEGENDRE[-2:] @ values) / scale)
                return self._rates(states), float(last.max())
            before = change
        return values, np.inf


def _first_length(rates: FloatArray, scale: FloatArray) -> float:
    """Length of a first step: some part of the time in which the state changes by its scale."""
    return 0.1 / max(float(np.max(np.abs(rates) / scale)), 1e-3)


def _inside(state: FloatArray, time: float, length: float, series: FloatArray) -> Inside:
    def at(times: FloatArray) -> FloatArray:
        x = 2 * (np.asarray(times) - time) / length - 1
        return np.asarray(state + legendre.legvander(x, _STAGES) @ series)

    return at
