"""What a property test costs that is red: a simulation for each example, and no search for the smallest one."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st


def test_the_first_example_that_fails_ends_a_test() -> None:
    """A property that nothing has ends after two runs, what failed and its repetition, and tells the example."""
    runs = []

    @settings(max_examples=50)
    @given(st.lists(st.floats(0, 1e6), min_size=3))
    def never(values: list[float]) -> None:
        runs.append(values)
        assert not values

    with pytest.raises(AssertionError) as caught:
        never()
    assert len(runs) <= 3
    assert any("never(" in note for note in caught.value.__notes__)


def test_who_looks_for_the_smallest_example_finds_it() -> None:
    """The other profile still shrinks."""
    runs = []

    @settings(settings.get_profile("shrinking"), max_examples=50)
    @given(st.floats(0, 1e6))
    def small(value: float) -> None:
        runs.append(value)
        assert value < 7

    with pytest.raises(AssertionError):
        small()
    assert runs[-1] == 7
