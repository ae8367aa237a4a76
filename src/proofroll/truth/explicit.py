"""Explicit integration (DOP853) step by step, with exact stops: what the polar route integrates with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
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


def read(pieces: list[Piece], where: FloatArray, first: FloatArray) -> FloatArray:
    """States, shape (n, k), at values of the independent variable within the pieces."""
    if not pieces or not len(where):
        return np.broadcast_to(first, (len(where), len(first))).copy()
    index = np.searchsorted([piece.start for piece in pieces], where, side="right") - 1
    return np.array([pieces[i].between(x) for i, x in zip(index, where, strict=True)])


def at_clock(pieces: list[Piece], times: FloatArray, first: FloatArray) -> FloatArray:
    """States of the slip, shape (n, 8), where its clock shows the times: Newton's method for τ."""
    if not pieces:
        return np.broadcast_to(first, (len(times), len(first))).copy()
    ends = np.array([piece.end for piece in pieces])
    tau = np.interp(times, [first[7], *(piece.last[7] for piece in pieces)], [0.0, *ends])
    for _ in range(20):
        y = read(pieces, tau, first)
        if not len(y) or np.all(np.abs(times - y[:, 7]) <= 4 * np.finfo(float).eps * times):
            break
        tau = np.clip(tau + (times - y[:, 7]) / np.exp(y[:, 5]), 0.0, ends[-1])
    return read(pieces, tau, first)
