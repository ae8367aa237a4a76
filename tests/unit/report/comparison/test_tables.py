"""Tables of a comparison: evidence from certificates."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from proofroll.core.certificate import Standing
from proofroll.report.comparison.tables import belief


def line(quantity: str, difference: float, tolerance: float) -> dict[str, Any]:
    """A line of a certificate."""
    return {
        "quantity": quantity,
        "difference": difference,
        "tolerance": tolerance,
        "standing": Standing.HOLDS,
        "holds": difference <= tolerance,
        "because": "",
    }


@pytest.mark.parametrize(
    ("lines", "largest"),
    [
        ([line("mass", 1e-9, 1e-6), line("count", 0.0, 0.0)], "mass"),
        ([line("mass", 1e-9, 1e-6), line("count", 1.0, 0.0)], "count"),
        ([line("mass", -9e-7, 1e-6), line("size", 1e-9, 1e-6)], "mass"),
        ([line("mass", math.inf, 1e-6), line("size", 1e-9, 1e-6)], "size"),
    ],
)
def test_an_allowance_of_zero_is_taken_whole_by_any_difference(lines: list[dict[str, Any]], largest: str) -> None:
    """The largest part of an allowance is found where nothing is allowed, too: none of it, or more than all."""
    run = SimpleNamespace(certificate=lines, point="")
    row = SimpleNamespace(observables={})
    content: Any = SimpleNamespace(observables={}, lines=lambda: [("alpha", row, [run])])
    (shown,) = belief(content)
    assert shown.largest is not None
    assert shown.largest["quantity"] == largest
