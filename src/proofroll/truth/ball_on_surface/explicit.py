"""Explicit integration (DOP853) step by step, with exact stops: what the polar route integrates with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.truth.ball_on_surface.route import End
from proofroll.truth.crossing import first_rise

_RTOL = 100 * np.finfo(float).eps  # the tightest that scipy accepts

Rates = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Piece:
    """One step of the integrator: from, to [s], and the states between."""

    start: float
    end: float
    first: FloatArray
    last: FloatArray
    between: Callable[[float], FloatArray]
    atol: FloatArray


def steps(
    rates: Rates,
    start: float,
    state: FloatArray,
    until: float,
    *,
    atol: FloatArray,
    cap: Callable[[FloatArray], float] | None = None,
) -> Iterator[Piece]:
    """Steps of DOP853 from ``start`` to ``until``, each no longer than ``cap`` says of the state before it."""
    if not until > start:
        return
    from scipy.integrate import DOP853

    solver = DOP853(lambda _, y: rates(y), start, state, until, rtol=_RTOL, atol=atol)
    while solver.status == "running":
        if cap is not None:
            solver.max_step = max(cap(solver.y), 1e-300)
        first = solver.y
        message = solver.step()
        if message is not None:
            raise Diverged(f"the truth (DOP853) could not be integrated past {solver.t:g}: {message}")
        yield Piece(solver.t_old, solver.t, first, solver.y, solver.dense_output(), atol)


def stop(rates: Rates, piece: Piece, g: Callable[[FloatArray], float]) -> tuple[float, FloatArray] | None:
    """Time and state where ``g`` first rises through zero in a step, the state integrated afresh up to there."""

    def along(times: FloatArray) -> FloatArray:
        return np.array([g(piece.between(t)) for t in times])

    time = first_rise(along, piece.start, piece.end)
    if time is None:
        return None
    for _ in range(3):
        state = _integrated(rates, piece, time)
        span = 1e-6 * (piece.end - piece.start)
        slope = (g(state + span * rates(state)) - g(state - span * rates(state))) / (2 * span)
        better = time - g(state) / slope if slope > 0 else time
        if not abs(better - time) > 2 * np.spacing(time) or not piece.start <= better <= piece.end:
            break
        time = better
    return time, _integrated(rates, piece, time)


def _integrated(rates: Rates, piece: Piece, time: float) -> FloatArray:
    last = piece.first
    for part in steps(rates, piece.start, piece.first, time, atol=piece.atol):
        last = part.last
    return last


class ExplicitRun:
    """A run from ``start`` until something ends it; see :class:`proofroll.truth.ball_on_surface.sliding.IntegratedRun`.

    Of each step ``ended`` tells where it reached what ends the run, the state there, and the reason; None: it goes on.
    See :func:`steps` for the rest.
    """

    def __init__(
        self,
        rates: Rates,
        start: float,
        state: FloatArray,
        until: float,
        *,
        atol: FloatArray,
        ended: Callable[[Piece], tuple[float, FloatArray, End] | None],
        cap: Callable[[FloatArray], float] | None = None,
    ) -> None:
        self._pieces: list[Piece] = []
        self.end, self.last, self.why = until, state, End.TIME
        for piece in steps(rates, start, state, until, atol=atol, cap=cap):
            self._pieces.append(piece)
            self.last = piece.last
            if found := ended(piece):
                self.end, self.last, self.why = found
                break
        self._ends = np.array([start, *(piece.end for piece in self._pieces)])
        self._states = np.array([state, *(piece.last for piece in self._pieces)])

    def steps(self) -> tuple[FloatArray, FloatArray]:
        """See :class:`proofroll.truth.ball_on_surface.sliding.IntegratedRun`."""
        return self._ends, self._states

    def at(self, where: FloatArray) -> FloatArray:
        """See :class:`proofroll.truth.ball_on_surface.sliding.IntegratedRun`."""
        if not self._pieces or not len(where):
            return np.broadcast_to(self._states[0], (len(where), self._states.shape[1])).copy()
        index = np.searchsorted(self._ends[:-1], where, side="right") - 1
        return np.array([self._pieces[i].between(x) for i, x in zip(index, where, strict=True)])
