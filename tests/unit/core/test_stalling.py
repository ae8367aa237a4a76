"""Steps of an error control that reach nothing, or are too many, are told from small ones that reach the end."""

from __future__ import annotations

import pytest

from proofroll.core.errors import Diverged
from proofroll.core.stalling import Stalled, StepCount, StepWatch


def test_steps_that_shrink_to_nothing() -> None:
    """Many steps in a row of a tiny part of the largest are a stall, with its time."""
    watch = StepWatch()
    watch.took(0.5, 1e-2, landing=False)
    for _ in range(20):
        watch.took(0.5, 1e-12, landing=False)
    with pytest.raises(Stalled, match=r"stalls at t = 0\.5 s: its steps shrink, as at a singular pose"):
        watch.took(0.5, 1e-12, landing=False)


@pytest.mark.parametrize(("length", "landing"), [(1e-12, True), (1e-8, False)])
def test_small_steps_for_a_reason(length: float, landing: bool) -> None:
    """Steps that samples end, and those of a motion that is fast for a while, are none."""
    watch = StepWatch()
    watch.took(0.5, 1e-2, landing=False)
    for _ in range(1000):
        watch.took(0.5, length, landing=landing)
    for _ in range(10):  # a few as small as a stall's, and on
        watch.took(0.5, 1e-12, landing=False)
    watch.took(0.5, 1e-3, landing=False)


def test_an_integration_that_needs_too_many_steps_ends_early() -> None:
    """A pace of a million steps is refused after 2000 of them; ten thousand steps are done."""
    count = StepCount(0.0, 1.0)
    for step in range(1, 2000):
        count.took(step * 1e-6)
    with pytest.raises(Diverged, match=r"its first 2000 steps, which reached t = 0.002 s"):
        count.took(2e-3)
    count = StepCount(0.0, 1.0)
    for step in range(1, 10_001):
        count.took(step * 1e-4)
