"""On which machines of a cluster results were made; those of this machine are not named."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from proofroll.running.case import Result


def hosts(results: Iterable[Result]) -> dict[str, int]:
    """Machine -> how many of the results it made; empty where all were made here."""
    return dict(sorted(Counter(result.host for result in results if result.host).items()))


def said_of(found: Mapping[str, int]) -> list[str]:
    """A sentence about results from other machines; none where there are none."""
    if not found:
        return []
    names = ", ".join(f"{count} on {name}" for name, count in found.items())
    return [f"Made on machines of a cluster: {names}. No speed is measured there."]
