"""Ranges of a parameter and numbers of copies, as a person writes them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from proofroll_throughput.variation import counts_of, pattern_of, variation_of

_VARY = ("throughput", "double_pendulum", "--vary")


def test_a_range_is_read_in_its_unit() -> None:
    """A range has eight values by default, or as many as it says, in the units that a parameter may have."""
    variation = variation_of("angle=0.5:2.5", "double_pendulum", {})
    assert (variation.parameter, len(variation.values), variation.values[0], variation.values[-1]) == (
        "angle", 8, 0.5, 2.5,
    )  # fmt: skip
    assert np.allclose(variation_of("angle=30 deg:90 deg:3", "double_pendulum", {}).values, np.radians([30, 60, 90]))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((*_VARY, "angle"), "--vary = 'angle': write PARAMETER=LOW:HIGH"),
        ((*_VARY, "angle=1"), "--vary = 'angle=1': write PARAMETER=LOW:HIGH"),
        ((*_VARY, "angle=2:1"), "--vary = 'angle=2:1': the range is empty"),
        ((*_VARY, "angle=1:2:40"), "--vary = 'angle=1:2:40': give 2 to 16 values"),
        ((*_VARY, "angle=low:2"), "angle = 'low'"),
        ((*_VARY, "angel=1:2"), "did you mean angle"),
        ((*_VARY, "angle=1:2", "--set", "angle=3"), "--set gives angle one value"),
        ((*_VARY, "angle=1:2", "--copies", "0"), "--copies = '0': give whole numbers from 1"),
        ((*_VARY, "angle=1:2", "--copies", "1,many"), "--copies = '1,many': give whole numbers from 1"),
        ((*_VARY, "angle=1:2", "--step", "0"), "--step = 0.0: give a step above 0 s"),
        ((*_VARY, "angle=1:2", "--plot", "picture.txt"), "--plot = 'picture.txt': end the name"),
        ((*_VARY, "angle=1:2", "--quantity", "q.knee"), "--quantity = 'q.knee': there is no such observable"),
        ((*_VARY, "angle=1:2", "--engine", "mujocco"), "engine = 'mujocco': there is no such engine"),
        ((*_VARY, "angle=1:2", "--engine", "mujoco[dt=1e-3]", "--step", "1e-2"), "has a step of its own"),
        (("throughput", "double_pendulum"), "Missing option '--vary'"),
    ],
)
def test_a_mistake_is_one_line(
    arguments: tuple[str, ...], said: str, command_line: Callable[..., tuple[int, str, str]]
) -> None:
    """Each wrong value is one line with its option and the remedy, before anything runs."""
    code, out, err = command_line(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert said in err


def test_numbers_of_copies_are_sorted() -> None:
    """Each number counts once."""
    assert counts_of("256, 1,16,16") == [1, 16, 256]


@pytest.mark.parametrize("copies", [1, 3, 8, 9, 100])
def test_values_have_equally_many_copies(copies: int) -> None:
    """No value has two copies more than another; one copy is the value in the middle, neighbours differ."""
    pattern = pattern_of(copies, 8)
    numbers = np.bincount(pattern, minlength=8)
    assert len(pattern) == copies
    assert numbers.max() - numbers.min() <= 1
    assert pattern_of(1, 8) == [4]
    assert all(value != following for value, following in pairwise(pattern))
