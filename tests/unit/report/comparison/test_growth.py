"""Cost over the one number that a comparison varies."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from proofroll.report.comparison.growth import Growth, growth


def found(values: list[float], untimed: tuple[float, ...] = (), **changes: Any) -> Growth | None:
    """The growth of a setting whose cost grows with the cube, and of a truth: with the square."""
    row = SimpleNamespace(
        engine="alpha", name="alpha", formulation="one", setting="default", resolution="dt", resolution_value=1e-3
    )
    runs = [
        SimpleNamespace(row=0, parameters={"links": n}, seconds_per_second=None if n in untimed else 0.2 * n**3)
        for n in values
    ]
    truths: Any = [SimpleNamespace(parameters={"links": n}, wall_seconds=3.0 * n**2) for n in values]
    content: Any = SimpleNamespace(**{"vary": {"links": values}, "points": [], "rows": [row], "runs": runs} | changes)
    return growth(content, truths)


def test_the_exponent_is_that_of_the_growth() -> None:
    """A cost that is a power of the parameter shows that power, without an error."""
    growing = found([5, 10, 20, 40, 80])
    assert growing is not None
    assert [line.exponent for line in growing.lines] == [pytest.approx(3.0), pytest.approx(2.0)]
    assert max(line.bar for line in growing.lines if line.bar is not None) < 1e-9


def test_what_is_missing_leaves_no_exponent() -> None:
    """Runs without a cost are gaps; with fewer than three costs there is no exponent, and nothing is made up."""
    growing = found([5, 10, 20, 40], untimed=(10, 20))
    assert growing is not None
    assert growing.lines[0].seconds == [pytest.approx(25.0), None, None, pytest.approx(12800.0)]
    assert growing.lines[0].exponent is None


@pytest.mark.parametrize(
    "changes", [{"vary": {}}, {"points": [{"links": 3}]}, {"vary": {"links": [0, 1, 2]}}, {"vary": {"links": [1, 2]}}]
)
def test_other_comparisons_have_no_growth(changes: dict[str, Any]) -> None:
    """Only one positive parameter over three values or more can show a power."""
    assert found([5, 10, 20], **changes) is None
