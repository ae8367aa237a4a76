"""Pareto front: points that no other point matches or beats in both cost and error."""

from collections.abc import Iterable
from typing import TypeVar

_Item = TypeVar("_Item")


def front(entries: Iterable[tuple[_Item, float, float]]) -> list[_Item]:
    """Items of ``(item, cost, error)`` that no other item matches or beats in both, cheapest first."""
    kept: list[_Item] = []
    best = float("inf")
    for item, _, error in sorted(entries, key=lambda entry: (entry[1], entry[2])):
        if error < best:
            kept.append(item)
            best = error
    return kept
