"""What a term is worth."""

from __future__ import annotations

import pytest

from proofroll.running.timing import Interval
from proofroll.studies.ladder.models import Need, Ran, need_of_term

CLEAR, NOISE = Interval(1.5, 1.4, 1.6, 0.97), Interval(1.5, 0.9, 2.0, 0.97)


@pytest.mark.parametrize(
    ("on", "off", "change", "cost", "tolerance", "verdict"),
    [
        (1e-5, 1e-2, 1e-2, CLEAR, None, Need.NEEDED),
        (1e-2, 1e-5, 1e-2, CLEAR, None, Need.HARMFUL),  # though the change is no more than the error with it
        (1e-5, 1e-5, 1e-6, CLEAR, None, Need.NOT_NEEDED),
        (1e-5, 1e-5, 1e-6, NOISE, None, Need.FREE),
        (1e-5, 1e-5, 1e-6, Interval(0.8, 0.7, 0.9, 0.97), None, Need.FREE),
        (1e-5, 1e-4, 9e-5, CLEAR, 1e-3, Need.NOT_NEEDED),  # more than the error, less than the tolerance
        (1e-5, 1e-4, 9e-5, CLEAR, 1e-5, Need.NEEDED),
        (0.0, 1e-11, 1e-11, CLEAR, None, Need.NOT_NEEDED),  # round-off of a quantity of size 0.1
        (0.0, 1e-11, 1e-11, CLEAR, 1e-12, Need.NEEDED),  # unless that is asked for
        (0.0, 1e-14, 1e-14, CLEAR, 1e-15, Need.NOT_NEEDED),  # but less than the truth is known to
        (None, 1e-5, None, None, None, Need.NO_ANSWER),
        (1e-5, None, None, None, None, Need.NEEDED),
    ],
)
def test_verdict(
    on: float | None,
    off: float | None,
    change: float | None,
    cost: Interval | None,
    tolerance: float | None,
    verdict: Need,
) -> None:
    """A term is needed, harmful, paid for or free by what leaving it out does, and saves."""
    sides = (Ran({}, "failed", "ended so", error, None) for error in (on, off))
    found, reason = need_of_term(*sides, change, cost, tolerance=tolerance, bar=1e-13, scale=0.1)
    assert found is verdict
    assert "\n" not in reason
    if on is None or off is None:
        assert "ended so" in reason
