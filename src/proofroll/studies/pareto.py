"""Which points nothing beats: at most as expensive and at most as wrong."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeVar

_Item = TypeVar("_Item")


def envelope(errors: Sequence[float]) -> list[float]:
    """The largest error of each run and of all finer ones that have a result; coarse first.

    A coarse run whose error happens to cancel is not believed while finer runs are worse.
    """
    held: list[float] = []
    worst = 0.0
    for error in reversed(errors):
        if error != float("inf"):
            worst = max(worst, error)
            held.append(worst)
        else:
            held.append(error)
    return held[::-1]


def front(entries: Iterable[tuple[_Item, float, float]]) -> list[_Item]:
    """The items of ``(item, cost, error)`` that no other item beats in both, cheapest first."""
    kept: list[_Item] = []
    best = float("inf")
    for item, _, error in sorted(entries, key=lambda entry: (entry[1], entry[2])):
        if error < best:
            kept.append(item)
            best = error
    return kept
