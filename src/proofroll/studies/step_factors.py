"""Ladders of steps that fit between the samples: a run ends a step at each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from proofroll.core.arrays import FloatArray
from proofroll.core.comparison import Row
from proofroll.core.engine import whole_steps
from proofroll.core.errors import InputError

USUAL = [4.0, 2.0, 1.0]
# In this order: finer steps cost more.
_LADDERS = (USUAL, [2.0, 1.0, 0.5], [1.0, 0.5, 0.25])


def unfit(factors: Sequence[float], step: float, times: FloatArray) -> InputError | None:
    """Error for a ladder that does not fit between the samples, or None; the last interval may be shorter."""
    for factor in factors:
        for start, end in (times[:2].tolist(), times[-2:].tolist()):
            try:
                whole_steps(start, end, factor * step)
            except InputError as error:
                return error
    return None


def fitting(row: Row, step: float | None, times: FloatArray) -> Row:
    """The row, with factors that fit where it has the usual ones and they do not.

    Args:
        row: of a comparison.
        step: of its engine [s]; None: it has none, or an adaptive one.
        times: of the samples [s].
    """
    if step is None or row.ladder != USUAL:
        return row
    ladder = next((factors for factors in _LADDERS if unfit(factors, step, times) is None), row.ladder)
    return replace(row, ladder=list(ladder))
