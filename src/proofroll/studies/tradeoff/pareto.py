"""Pareto front: points that no other point matches or beats in both cost and error."""

from collections.abc import Iterable, Sequence
from typing import TypeVar

_Item = TypeVar("_Item")


def costs_overlap(cost: Sequence[float] | None, rival: Sequence[float] | None) -> bool:
    """True if the intervals (low, high) of two costs overlap; False if one is missing."""
    return cost is not None and rival is not None and cost[0] <= rival[1] and rival[0] <= cost[1]


def front(entries: Iterable[tuple[_Item, float, float]]) -> list[_Item]:
    """Items of ``(item, cost, error)`` that no other item matches or beats in both, cheapest first."""
    kept: list[_Item] = []
    best = float("inf")
    for item, _, error in sorted(entries, key=lambda entry: (entry[1], entry[2])):
        if error < best:
            kept.append(item)
            best = error
    return kept
