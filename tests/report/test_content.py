"""What a report says of a row over all of its cases."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from proofroll.core.verdict import Judgement, Verdict
from proofroll.report.comparison.summary import _worst


def _run(speed: float, error: float, tolerance: float) -> Any:
    verdict = Verdict.AGREES if error <= tolerance else Verdict.DIFFERS
    judgement = Judgement(
        observable="N", unit="N", error=error, truth_error_bar=1e-12, tolerance=tolerance, scale=40.0, verdict=verdict
    )
    return SimpleNamespace(parameters={"speed": speed}, judgements=[judgement])


def test_the_largest_error_of_a_row_is_that_of_all_its_cases() -> None:
    """The case that is furthest beyond its own tolerance need not have the largest error; both are said."""
    found = _worst([_run(2.0, 0.5, 0.1), _run(6.0, 0.9, 1.0)], "N")
    assert (found.error, found.point) == (0.5, "speed=2")
    assert found.largest == 0.9
