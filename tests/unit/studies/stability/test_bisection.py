"""The search for boundaries on a ladder, with made-up verdicts."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from proofroll.studies.failure import RunOutcome
from proofroll.studies.stability.map import SearchResult, search


def found(
    stable: Callable[[int], bool], accurate: Callable[[int], bool], size: int = 35, affordable: int = 35
) -> SearchResult:
    """What a search finds if rungs behave so."""
    searching = search(size, 4)
    rung = next(searching)
    while True:
        verdict = RunOutcome(stable(rung), accurate(rung), None, False, None, None, "") if rung < affordable else None
        try:
            rung = searching.send(verdict)
        except StopIteration as stop:
            return stop.value  # type: ignore[no-any-return]  # StopIteration has no type


def boundaries(result: SearchResult) -> list[tuple[int | None, int | None]]:
    """Coarsest that holds and the failing one beside it, for stable and for accurate."""
    return [result.boundary(lambda v: v.stable), result.boundary(lambda v: v.accurate)]


@pytest.mark.parametrize("first", range(0, 24, 3))
def test_a_clean_boundary(first: int) -> None:
    """The boundary is found to the rung, with fewer runs than half of the ladder."""
    result = found(lambda rung: rung >= first, lambda rung: rung >= first + 3)
    failing = first - 1 if first else None
    assert boundaries(result) == [(first, failing), (first + 3, first + 2)]
    assert len(result.seen) <= 17


def test_nothing_is_asked_twice() -> None:
    """Each rung is asked for at most once."""
    asked = []

    def stable(rung: int) -> bool:
        asked.append(rung)
        return rung >= 7

    found(stable, lambda rung: rung >= 9)
    assert len(asked) == len(set(asked))


def test_a_step_that_fails_below_one_that_passes() -> None:
    """What passes above a step that fails is not called stable: here 8 passes by luck, and 12 fails."""
    stable = {0: False, 4: False, 8: True, 12: False}
    result = found(lambda rung: stable.get(rung, rung > 13), lambda rung: rung > 15)
    assert boundaries(result)[0][0] == 14
    assert 12 in result.seen


def test_luck_beside_the_boundary() -> None:
    """A pass with a failure right below it moves the boundary below that failure."""
    result = found(lambda rung: rung >= 10 and rung != 11, lambda rung: rung >= 10 and rung != 11)
    assert boundaries(result)[0] == (12, 11)


def test_nothing_holds() -> None:
    """Where no rung passes there is no boundary, and the finest that ran is what is shown."""
    result = found(lambda _: False, lambda _: False)
    assert boundaries(result)[0][0] is None
    assert boundaries(result)[0][1] == max(result.seen)


@pytest.mark.parametrize("affordable", [1, 5, 6, 13])
def test_too_slow(affordable: int) -> None:
    """Rungs that take too long are left out, and the finest affordable one is tried."""
    result = found(lambda _: False, lambda _: False, affordable=affordable)
    assert result.limit <= affordable + 4
    assert max(result.seen) == affordable - 1


def test_even_the_coarsest_is_too_slow() -> None:
    """A search of which nothing is affordable ends with nothing."""
    result = found(lambda _: True, lambda _: True, affordable=0)
    assert result.seen == {}
    assert result.limit == 0


@pytest.mark.parametrize("first", range(0, 24, 3))
def test_the_finest_run_is_near_the_boundary(first: int) -> None:
    """The finest run costs most: none is more than a stride and a half below the boundary of accuracy."""
    assert max(found(lambda rung: rung >= first, lambda rung: rung >= first).seen) < first + 6
