"""Order in which cases that wait are handed out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from proofroll.running.runner import WaitingCases


def case(key: str, engine: str) -> Any:
    """A case, as far as its order is concerned."""
    return SimpleNamespace(key=key, engine=SimpleNamespace(name=engine))


def test_earlier_places_come_first_and_a_worker_keeps_its_engine_within_one() -> None:
    """All cases of the first place are begun before any of the second, those of a worker's engine first."""
    waiting = WaitingCases(priority={"a1": 0, "b1": 0, "a2": 0, "a3": 1, "b2": 1})
    for key in ("a3", "b2", "a1", "b1", "a2"):
        waiting.add(case(key, key[0]))
    taken = [waiting.take("a"), waiting.take("a"), waiting.take("a"), waiting.take("b"), waiting.take("b")]
    assert [item.key for item in taken if item] == ["a1", "a2", "b1", "b2", "a3"]


def test_without_places_a_worker_keeps_its_engine() -> None:
    """Another engine's cases wait until a worker is free for them; an engine that nobody has begun goes first."""
    waiting = WaitingCases()
    for key in ("a1", "b1", "a2"):
        waiting.add(case(key, key[0]))
    taken = [waiting.take(None), waiting.take(None), waiting.take("b")]
    assert [item.key for item in taken if item] == ["a1", "b1", "a2"]
