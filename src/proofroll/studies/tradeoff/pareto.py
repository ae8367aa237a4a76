"""Pareto front: points that no other is both as cheap and as accurate as."""

from collections.abc import Iterable, Sequence
from typing import TypeVar

_Item = TypeVar("_Item")

# How many finer runs must not be worse: one alone may cancel by chance too.
_NEIGHBOURS = 2


def envelope(errors: Sequence[float]) -> list[float]:
    """The largest error of each run and of the next finer ones that have a result; coarse first.

    A coarse run whose error happens to cancel is not believed while its finer neighbours are worse. Only neighbours
    count: that round-off grows again at steps a hundred times smaller says nothing about this one.
    """
    held = []
    for index, error in enumerate(errors):
        finer = [other for other in errors[index + 1 :] if other != float("inf")][:_NEIGHBOURS]
        held.append(max([error, *finer]))
    return held


def tied(one: Sequence[float] | None, other: Sequence[float] | None) -> bool:
    """True if the intervals (low, high) of two costs overlap; False if one has none."""
    return one is not None and other is not None and one[0] <= other[1] and other[0] <= one[1]


def front(entries: Iterable[tuple[_Item, float, float]]) -> list[_Item]:
    """The items of ``(item, cost, error)`` that no other item beats in both, cheapest first."""
    kept: list[_Item] = []
    best = float("inf")
    for item, _, error in sorted(entries, key=lambda entry: (entry[1], entry[2])):
        if error < best:
            kept.append(item)
            best = error
    return kept
