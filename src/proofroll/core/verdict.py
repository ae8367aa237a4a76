"""The verdict: how an observable of one run stands to the truth, both with their error bars."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.convergence import Limit


class Verdict(StrEnum):
    """How a run stands to the truth."""

    AGREES = "agrees"  # within tolerance at this step
    CONVERGES = "converges"  # not yet, but the limit of small steps is the truth
    ILL_POSED = "ill-posed"  # here the answer hangs on less than the parameters are known to; nobody can be judged
    DIFFERS = "differs"  # the limit is something else, or no limit shows: not this model at this step
    FAILED = "failed"  # there is no result


@dataclass(frozen=True)
class Judgement:
    """One observable of one run.

    Attributes:
        observable, unit: what was compared.
        error: largest distance from the truth.
        truth_error_bar: of the truth, in the same unit.
        tolerance: largest error that counts as agreement.
        scale: size of the observable in this case.
        verdict: see :class:`Verdict`.
        order: observed order, or None.
        limit_error: distance of the limit of small steps from the truth, or None without a ladder.
        limit_error_bar: uncertainty of that limit.
    """

    observable: str
    unit: str
    error: float
    truth_error_bar: float
    tolerance: float
    scale: float
    verdict: Verdict
    order: float | None = None
    limit_error: float | None = None
    limit_error_bar: float | None = None


def judge(
    name: str,
    unit: str,
    values: FloatArray,
    true: FloatArray,
    *,
    truth_error_bar: float,
    tolerance: float,
    scale: float,
    limit: Limit | None,
    ill_posed: bool = False,
) -> Judgement:
    """Holds a curve and its limit of small steps against the true curve.

    Where the question is ill-posed, a curve that would differ is not judged.
    """
    error = _distance(values, true)
    limit_error = None if limit is None else _distance(limit.values, true)
    if error <= tolerance:
        verdict = Verdict.AGREES
    elif np.isfinite(error) and limit is not None and _converges(tolerance, limit, limit_error, truth_error_bar):
        verdict = Verdict.CONVERGES
    else:
        verdict = Verdict.ILL_POSED if ill_posed else Verdict.DIFFERS
    return Judgement(
        observable=name,
        unit=unit,
        error=error,
        truth_error_bar=truth_error_bar,
        tolerance=tolerance,
        scale=scale,
        verdict=verdict,
        order=None if limit is None or not np.isfinite(limit.order) else limit.order,
        limit_error=limit_error,
        limit_error_bar=None if limit is None else limit.error_bar,
    )


def _converges(tolerance: float, limit: Limit, limit_error: float | None, truth_error_bar: float) -> bool:
    """The limit is the truth within both error bars, and is known to within the tolerance.

    Without the second condition a scattered ladder, whose error bar is as large as its error, would pass.
    """
    near = limit_error is not None and limit_error <= limit.error_bar + truth_error_bar
    return near and limit.error_bar <= tolerance


def _distance(values: FloatArray, true: FloatArray) -> float:
    if values.shape != true.shape:
        return float("inf")  # one of the two has what the other has not
    distance = float(np.max(np.abs(values - true), initial=0.0))
    return distance if np.isfinite(distance) else float("inf")
