from __future__ import annotations

import math

import numpy as np
import pytest

from proofroll.core.convergence import Limit, richardson
from proofroll.core.verdict import Judgement, Verdict, judge

T = np.linspace(0, 2, 21)
TRUE = np.sin(3 * T)


def verdict_of(error: float, limit: Limit | None = None, *, bar: float = 1e-12, tolerance: float = 1e-3) -> Judgement:
    """The judgement of a curve that is off by ``error``."""
    return judge("z", "m", TRUE + error, TRUE, truth_error_bar=bar, tolerance=tolerance, scale=1.0, limit=limit)


def ladder(power: float, offset: float = 0.0) -> Limit:
    """The limit of curves of some order, the finest off by 0.01."""
    return richardson([TRUE + offset + 0.01 * h**power * (1 + 0.01 * h) for h in (4, 2, 1)], (4, 2, 1))


def test_agrees_within_tolerance() -> None:
    """An error up to the tolerance agrees, whatever the limit is."""
    assert verdict_of(0.999e-3).verdict is Verdict.AGREES
    assert verdict_of(1e-4, ladder(1, offset=5.0)).verdict is Verdict.AGREES


def test_converges_if_the_limit_is_the_truth() -> None:
    """Beyond the tolerance, with the truth as the limit of small steps, the step alone is too coarse."""
    found = verdict_of(0.011, ladder(1))
    assert found.verdict is Verdict.CONVERGES
    assert found.order == pytest.approx(1, abs=0.1)
    assert found.limit_error is not None
    assert found.limit_error_bar is not None
    assert found.limit_error <= found.limit_error_bar * (1 + 1e-9) < 0.0055


def test_differs_if_the_limit_is_something_else() -> None:
    """A limit beyond both error bars means another model."""
    assert verdict_of(0.061, ladder(1, offset=0.05)).verdict is Verdict.DIFFERS


def test_differs_without_a_ladder() -> None:
    """Without a limit nothing speaks for convergence."""
    found = verdict_of(0.01)
    assert found.verdict is Verdict.DIFFERS
    assert (found.order, found.limit_error, found.limit_error_bar) == (None, None, None)


def test_a_scattered_ladder_does_not_converge() -> None:
    """A limit whose error bar is as large as the error says nothing and does not pass."""
    scattered = Limit(TRUE + 0.01, 0.05, math.nan)
    assert verdict_of(0.01, scattered).verdict is Verdict.DIFFERS


def test_the_error_bar_of_the_truth_counts() -> None:
    """A limit that misses the truth by less than the truth's own error bar is the truth."""
    limit = Limit(TRUE + 1e-3, 1e-6, 2.0)
    assert verdict_of(0.01, limit, bar=2e-3).verdict is Verdict.CONVERGES
    assert verdict_of(0.01, limit, bar=2e-4).verdict is Verdict.DIFFERS


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_values_that_are_not_finite_differ(value: float) -> None:
    """NaN and infinity are never within a tolerance."""
    found = verdict_of(value, ladder(1))
    assert found.verdict is Verdict.DIFFERS
    assert found.error == math.inf


def test_verdicts_are_ordered_from_best_to_worst() -> None:
    """Summaries take the worst verdict by this order."""
    assert list(Verdict) == ["agrees", "converges", "ill-posed", "differs", "failed"]
