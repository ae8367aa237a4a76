"""Explicit integration (DOP853), step by step, with exact ends: the integrator of the polar route."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dop853 import TIGHTEST, controlled_step, solver_from
from proofroll.papers.blajer_2006.truth.sliding import End

Rates = Callable[[FloatArray], FloatArray]


class ExplicitRun:
    """Integration from ``start`` to its end; implements :class:`.IntegratedRun`.

    After each step ``ended`` gets the solver and returns time [s], state and reason of an end within that step; None:
    the run goes on.
    """

    def __init__(
        self,
        rates: Rates,
        start: float,
        state: FloatArray,
        until: float,
        *,
        atol: FloatArray,
        ended: Callable[[Any], tuple[float, FloatArray, End] | None],
    ) -> None:
        self.end, self.last, self.why = until, state, End.TIME
        self._between: list[Callable[[float], FloatArray]] = []
        starts = [start]
        # rates may not be finite for a run of zero length
        solver = solver_from(lambda _, y: rates(y), start, state, TIGHTEST, atol) if until > start else None
        while solver is not None and solver.t < until:
            controlled_step(solver, None, until, math.inf)
            self._between.append(solver.dense_output())
            starts.append(solver.t)
            self.last = solver.y
            if stopped := ended(solver):
                self.end, self.last, self.why = stopped
                break
        self._starts = np.array(starts[:-1])

    def at(self, places: FloatArray) -> FloatArray:
        """See :class:`proofroll.papers.blajer_2006.truth.sliding.IntegratedRun`."""
        if not self._between or not len(places):
            return np.broadcast_to(self.last, (len(places), len(self.last))).copy()
        index = np.searchsorted(self._starts, places, side="right") - 1
        return np.array([self._between[i](x) for i, x in zip(index, places, strict=True)])
