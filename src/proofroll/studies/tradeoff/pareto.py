"""Pareto front: points that no other point matches or beats in both cost and error."""

from collections.abc import Iterable, Sequence
from typing import TypeVar

_Item = TypeVar("_Item")

# Number of finer runs that must not be worse; the error of a single one may cancel by chance, too.
_NEIGHBOURS = 2


def envelope(errors: Sequence[float], floor: int | None = None) -> list[float]:
    """Largest error of each run and of the next two finer ones that have a result; coarse first.

    So a coarse run whose error cancels by chance does not count as accurate. Only the next runs matter: round-off that
    grows at much smaller steps does not make a coarse run worse.

    Args:
        errors: coarse first; inf: no result.
        floor: number of the run at the error floor of single precision; finer runs do not count. None: no floor.
    """
    last = len(errors) if floor is None else floor + 1
    largest = []
    for index, error in enumerate(errors[:last]):
        finer = [other for other in errors[index + 1 : last] if other != float("inf")][:_NEIGHBOURS]
        largest.append(max([error, *finer]))
    return [*largest, *errors[last:]]


def costs_overlap(one: Sequence[float] | None, other: Sequence[float] | None) -> bool:
    """True if the intervals (low, high) of two costs overlap; False if one is missing."""
    return one is not None and other is not None and one[0] <= other[1] and other[0] <= one[1]


def front(entries: Iterable[tuple[_Item, float, float]]) -> list[_Item]:
    """Items of ``(item, cost, error)`` that no other item matches or beats in both, cheapest first."""
    kept: list[_Item] = []
    best = float("inf")
    for item, _, error in sorted(entries, key=lambda entry: (entry[1], entry[2])):
        if error < best:
            kept.append(item)
            best = error
    return kept
