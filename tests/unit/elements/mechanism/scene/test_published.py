"""``[[published]]`` of a scene file: instants, series, and what they allow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.published import last_digit, read_published

TABLE: dict[str, Any] = {"source": "a book", "times": [0.0, 0.5], "q.slide": [2.0, -0.0123]}


def test_a_series_allows_a_unit_of_the_last_digit_of_each_value() -> None:
    """Each value has its own last digit; a known error of all replaces it."""
    (series,) = read_published([TABLE])
    assert series.allowed("q.slide") == pytest.approx([1.0, 1e-4], rel=1e-12)
    (series,) = read_published([{**TABLE, "within": 0.5}])
    assert np.all(series.allowed("q.slide") == 0.5)
    assert last_digit(4.9e-06) == pytest.approx(1e-7, rel=1e-12)


def test_an_instant_is_a_series_of_one() -> None:
    """``time`` takes one number for each observable."""
    (instant,) = read_published([{"source": "a book", "time": 2, "v.turn": 3}])
    assert (instant.times, instant.values) == ((2.0,), {"v.turn": (3.0,)})


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ({"source": ""}, r"published\.0\.source"),
        ({"times": [0.5, 0.5]}, r"published\.0\.times = \[0\.5, 0\.5\]: must ascend"),
        ({"time": 1.0}, r"published\.0\.time"),
        ({"q.slide": [1.0]}, r"published\.0\.q\.slide = '?1 numbers'?: give 2, one for each of times"),
        ({"q.slide": 1.0}, r"published\.0\.q\.slide = 1\.0: give a list of numbers"),
        ({"q.slide": [1.0, "two"]}, r"published\.0\.q\.slide"),
        ({"within": -1e-3}, r"published\.0\.within"),
        ({"parameters": 3}, r"published\.0\.parameters"),
    ],
)
def test_a_wrong_table_gets_one_line(table: dict[str, Any], line: str) -> None:
    """The line names the key."""
    with pytest.raises(InputError, match=line) as caught:
        read_published([{**TABLE, **table}])
    assert "\n" not in str(caught.value)
