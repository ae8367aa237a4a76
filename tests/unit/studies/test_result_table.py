"""Tables of results in a notebook, and on a terminal."""

from __future__ import annotations

import math
import re

import pytest

from proofroll.studies.result_table import gauge, html_table, text_table


@pytest.mark.parametrize(
    ("error", "where"), [(0.0, 6), (1e-10, 6), (1e-6, 33), (1e-3, 60), (1.0, 87), (1e9, 114), (math.inf, 114)]
)
def test_a_gauge_shows_the_decades_between_an_error_and_its_tolerance(error: float, where: float) -> None:
    """Nine pixels are a decade from the tolerance in the middle, and six decades are as far as it goes."""
    found = re.search(r'cx="([\d.]+)"', gauge(error, 1e-3))
    assert found is not None
    assert float(found[1]) == pytest.approx(where, abs=0.1)


def test_what_is_not_finite_is_at_the_far_end() -> None:
    """No number at all is as wrong as can be."""
    assert gauge(math.nan, 1.0).split("circle")[1] == gauge(math.inf, 1.0).split("circle")[1]


def test_a_table_without_gauges_has_no_column_for_them() -> None:
    """The column of drawings is there where rows have some."""
    assert html_table("h", ("", "a"), [("x", "1")]).count("<th>") == 3
    assert "<svg" in html_table("h", ("", "a"), [("x", "1")], gauges=[gauge(1, 2)])


def test_a_table_for_a_terminal_has_aligned_columns() -> None:
    """Each column is as wide as its longest text; long ones are cut, but the last, which is the reason."""
    lines = text_table(("", "verdict", "why"), [("x" * 50, "agrees", "y" * 60), ("z", "differs", "")])
    assert lines[0] == f"{'':40}  verdict  why"
    assert lines[1] == f"{'x' * 39}…  agrees   {'y' * 60}"
    assert lines[2] == f"{'z':40}  differs"
