"""The times at which a run is sampled."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.core.time_grid import require_whole_steps, sampling_interval, time_grid


@pytest.mark.parametrize(
    ("until", "every", "times"),
    [
        (0.3, 0.1, [0, 0.1, 0.2, 0.3]),
        (0.25, 0.1, [0, 0.1, 0.2, 0.25]),
        (0, 0.1, [0]),
        (0.05, 0.1, [0, 0.05]),
        (1, 1 / 3, [0, 1 / 3, 2 / 3, 1]),
    ],
)
def test_time_grid(until: float, every: float, times: list[float]) -> None:
    """Samples are taken at every multiple of the interval and at the end, each once."""
    grid = time_grid(until, every)
    assert grid == pytest.approx(times, abs=1e-15)
    assert grid[-1] == until


@pytest.mark.parametrize("given", [("1", 0.1), (None, 0.1), (1.0, "x"), (1.0, [1])])
def test_what_is_no_time(given: Any) -> None:
    """A text or a list is told by its name, not by an error of numpy's."""
    with pytest.raises(InputError, match="give a number in s"):
        time_grid(*given)


@pytest.mark.parametrize(("step", "every"), [(None, 0.01), (1e-3, 0.01), (1 / 240, 2 / 240), (0.03, 0.03)])
def test_sampling_interval(step: float | None, every: float) -> None:
    """Where nobody says how often to sample it is about every 0.01 s, at ends of steps."""
    assert sampling_interval(step) == pytest.approx(every)


def test_an_end_off_the_steps_names_one_that_is_on_them() -> None:
    """Where only the last interval has no whole number of steps, the line says where to end instead."""
    with pytest.raises(InputError, match=r"end at 0\.123 s") as caught:
        require_whole_steps(time_grid(0.1234567, 0.01), 1e-3)
    assert (caught.value.field, caught.value.value) == ("until", 0.1234567)
    require_whole_steps(time_grid(0.123, 0.01), 1e-3)


def test_time_grid_ends_exactly() -> None:
    """Two hundred steps of 0.01 s end at 2 s, not at 2.0000000000000004 s."""
    grid = time_grid(2.0, 0.01)
    assert (len(grid), grid[-1]) == (201, 2.0)


@pytest.mark.parametrize(
    ("until", "every", "field"),
    [
        (-1, 0.1, "until"), (np.nan, 0.1, "until"), (np.inf, 0.1, "until"),
        (1, 0, "every"), (1, -0.1, "every"), (1, np.nan, "every"), (1, np.inf, "every"), (1e6, 1e-6, "every"),
    ],
)  # fmt: skip
def test_bad_times(until: float, every: float, field: str) -> None:
    """Times that make no sense, or more samples than any disk holds, are refused by name."""
    with pytest.raises(InputError) as caught:
        time_grid(until, every)
    assert caught.value.field == field
