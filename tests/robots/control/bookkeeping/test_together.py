"""Mistakes of one layer are named together where each alone leaves a part of it wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from proofroll.robots.control.bookkeeping.mistakes import Mistake, SearchTime
from proofroll.robots.control.bookkeeping.search import LayerTrials, mistakes_together

# Columns: a law is a tuple of their numbers, and the record has these.
RECORDED = (3.0, -1.0, 5.0)
BAR = 1e-9


def mistake(name: str, changed: Callable[..., Any], *, sized: bool = False, opposite: str = "") -> Mistake:
    """A mistake of a tuple of numbers."""
    words = f"{name} {{size}}" if sized else name
    return Mistake(id=name, words=words, layer="target", changed=changed, sized=sized, opposite=opposite)


FIRST = mistake("first", lambda law, _: (3.0, law[1], law[2]))
SECOND = mistake("second", lambda law, _: (law[0], -1.0, law[2]))
THIRD = mistake("third", lambda law, size: (law[0], law[1], size * law[2]), sized=True)
SPOILS = mistake("spoils", lambda law, _: (3.0, 7.0, law[2]))
BOTH = mistake("both", lambda law, _: (3.0, -1.0, law[2]))
ADDED = mistake("added", lambda law, _: (law[0] + 1.0, law[1], law[2]))
TIMES = mistake("times", lambda law, size: (size * law[0], law[1], size * law[2]), sized=True, opposite="other signs")


def told(law: tuple[float, ...], *candidates: Mistake, time: SearchTime | None = None) -> tuple[str, str] | None:
    """Names and sentence of the mistakes that lead from a law to the record."""

    def left(trial: Any) -> Any:
        return np.array(trial) - RECORDED

    trials = LayerTrials(lambda trial: np.abs(left(trial)) / BAR, left, lambda _: iter(()))
    cause = mistakes_together(candidates, law, trials, time or SearchTime())  # type: ignore[arg-type]
    return None if cause is None else (cause.id, cause.sentence)


@pytest.mark.parametrize("order", [(FIRST, SECOND, THIRD), (THIRD, SECOND, FIRST)])
def test_mistakes_of_separate_columns_are_named_one_by_one(order: tuple[Mistake, ...]) -> None:
    """Each closes its columns, in whatever order the mistakes are listed; one with a size is the last."""
    names, sentence = told((1.0, 1.0, 2.5), *order) or ("", "")
    assert set(names.split(" + ")) == {"first", "second", "third"}
    assert "third 2" in sentence


def test_what_closes_most_is_named_first() -> None:
    """A mistake that closes two columns is named in place of one for each of them."""
    assert (told((1.0, 1.0, 2.5), FIRST, SECOND, BOTH, THIRD) or ("", ""))[0] == "both + third"


def test_two_mistakes_of_the_same_columns_are_a_pair() -> None:
    """A mistake without a size and one whose size fits, of which neither closes the column, do together."""
    assert told((0.5, -1.0, 2.5), ADDED, TIMES) == ("added + times", "added; and times 2")
    assert told((0.2, -1.0, 2.0), ADDED, TIMES) == ("added + times", "added; and times 2.5")
    assert told((-4.0, -1.0, -5.0), ADDED, TIMES) == ("added + times", "added; and other signs")


def test_nothing_is_named_that_leaves_a_column_wrong() -> None:
    """What spoils a right column, leaves one wrong, or needs more time than there is, is no cause."""
    assert told((1.0, -1.0, 2.0), SPOILS, SECOND, THIRD) is None
    assert told((1.0, 1.0, 2.0), FIRST, SECOND) is None
    assert told((1.0, 1.0, 2.5), FIRST, SECOND, THIRD, time=SearchTime(-math.inf)) is None
    assert told((0.5, -1.0, 2.5), ADDED, TIMES, time=SearchTime(-math.inf)) is None


def test_a_single_mistake_is_left_to_others() -> None:
    """One mistake that closes all columns is not told as several."""
    assert told((1.0, -1.0, 5.0), FIRST) is None


def test_a_size_is_fitted_where_it_changes_what_is_wrong() -> None:
    """A mistake that leaves a wrong column as it is is tried at its starts alone, and one that reaches it is fitted."""
    tried: list[float] = []

    def changed(law: tuple[float, ...], size: float) -> tuple[float, ...]:
        tried.append(size)
        return law[0], size * law[1], law[2]

    elsewhere = mistake("elsewhere", changed, sized=True)
    assert told((0.5, -1.0, 2.5), ADDED, TIMES, elsewhere) == ("added + times", "added; and times 2")
    assert set(tried) == {0.95}
