"""The Pareto front, and errors that are not believed."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from proofroll.core.convergence import envelope
from proofroll.studies.tradeoff.pareto import front

NUMBERS = st.floats(min_value=1e-12, max_value=1e6)


@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=30))
def test_nothing_beats_the_front_and_it_beats_the_rest(entries: list[tuple[float, float]]) -> None:
    """No entry beats one of the front in both cost and error, and every other entry is beaten or equalled by one."""
    chosen = front([(index, cost, error) for index, (cost, error) in enumerate(entries)])
    for index in chosen:
        cost, error = entries[index]
        assert not any(c < cost and e < error for c, e in entries)
    for cost, error in entries:
        assert any(entries[index][0] <= cost and entries[index][1] <= error for index in chosen)
    costs = [entries[index][0] for index in chosen]
    assert costs == sorted(costs)


@given(st.lists(NUMBERS | st.just(math.inf), max_size=20))
def test_envelope_never_promises_less_than_its_finer_neighbours_show(errors: list[float]) -> None:
    """The envelope is at least each run's own error, and at least that of the next two finer runs with a result."""
    held = envelope(errors)
    for index, value in enumerate(held):
        finer = [error for error in errors[index + 1 :] if error != math.inf][:2]
        assert value == max([errors[index], *finer])


def test_round_off_of_much_finer_steps_is_not_luck() -> None:
    """A run is believed although round-off grows again where steps are far smaller."""
    assert envelope([1e-3, 1e-6, 1e-9, 2e-9, 1e-8, 1e-7])[:3] == [1e-3, 1e-6, 1e-8]
