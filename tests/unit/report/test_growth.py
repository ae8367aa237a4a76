"""Cost over the one number that a comparison varies."""

from __future__ import annotations

from typing import Any

import pytest

from proofroll.report.growth import growth


def compared(values: list[float], **changes: Any) -> dict[str, Any]:
    """What a comparison says of a setting whose cost grows with the cube, and of a truth: with the square."""
    return {
        "vary": {"links": values},
        "points": [],
        "rows": [
            {
                "engine": "alpha",
                "name": "alpha",
                "formulation": "one",
                "setting": "default",
                "resolution": "dt",
                "resolution_value": 1e-3,
            }
        ],
        "runs": [{"row": 0, "parameters": {"links": n}, "seconds_per_second": 0.2 * n**3} for n in values],
        "truths": [{"parameters": {"links": n}, "wall_seconds": 3.0 * n**2} for n in values],
    } | changes


def test_the_exponent_is_that_of_the_growth() -> None:
    """A cost that is a power of the parameter shows that power, without an error."""
    found = growth(compared([5, 10, 20, 40, 80]))
    assert found is not None
    assert [line["exponent"] for line in found["lines"]] == [pytest.approx(3.0), pytest.approx(2.0)]
    assert max(line["bar"] for line in found["lines"]) < 1e-9


def test_what_is_missing_leaves_no_exponent() -> None:
    """Runs without a cost are gaps; with fewer than three costs there is no exponent, and nothing is made up."""
    content = compared([5, 10, 20, 40])
    for run in content["runs"][1:3]:
        run["seconds_per_second"] = None
    found = growth(content)
    assert found is not None
    assert found["lines"][0]["seconds"] == [pytest.approx(25.0), None, None, pytest.approx(12800.0)]
    assert found["lines"][0]["exponent"] is None


@pytest.mark.parametrize(
    "changes", [{"vary": {}}, {"points": [{"links": 3}]}, {"vary": {"links": [0, 1, 2]}}, {"vary": {"links": [1, 2]}}]
)
def test_other_comparisons_have_no_growth(changes: dict[str, Any]) -> None:
    """Only one positive parameter over three values or more can show a power."""
    assert growth(compared([5, 10, 20], **changes)) is None
