"""Judging of a curve by numbers alone, without the records of :mod:`proofroll.core.verdict`."""

from typing import Any

from proofroll.core.arrays import FloatArray
from proofroll.core.convergence import Limit
from proofroll.core.verdict import Allowance, Judgement, Refinement, RunCurve, TrueCurve, judge_curve


def judged_curve(
    name: str,
    unit: str,
    values: FloatArray,
    true: FloatArray,
    *,
    truth_error_bar: float = 0.0,
    tolerance: float,
    scale: float = 1.0,
    ill_posed: str = "",
    limit: Limit | None = None,
    ladder: bool = False,
    **of_run: Any,
) -> Judgement:
    """Judgement of an observable; ``of_run``: further attributes of the run's curve."""
    known = TrueCurve(true, truth_error_bar, ill_posed)
    return judge_curve(
        Allowance(name, unit, tolerance, scale), RunCurve(values, **of_run), known, Refinement(limit, ladder)
    )
