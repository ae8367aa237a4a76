"""What a comparison's section shows besides verdicts: all that is claimed, and cost with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from proofroll.core.comparison import ExceptAt, Row, Tolerance
from proofroll.report.labels import number, unit
from proofroll.running.timing import Timing


@dataclass(frozen=True)
class Cost:
    """Wall seconds per simulated second over so many ``runs``; one run has no interval."""

    median: float
    low: float | None
    high: float | None
    confidence: float | None
    runs: int

    @classmethod
    def of(cls, timings: Sequence[float]) -> Cost | None:
        """The cost of runs, or None of none."""
        if not timings:
            return None
        found = Timing(tuple(timings)).interval
        if not found.confidence:
            return cls(found.value, None, None, None, len(timings))
        return cls(found.value, found.low, found.high, found.confidence, len(timings))


@dataclass(frozen=True)
class Claims:
    """What is expected of a row besides its verdict: bounds of its own, orders, limits, and other points' verdicts."""

    bound: dict[str, str]
    order: dict[str, tuple[float, float]]
    limit: dict[str, str]
    except_at: list[ExceptAt]
    only: dict[str, list[float]]

    @classmethod
    def of(cls, row: Row) -> Claims:
        """Those of a row of a comparison file."""
        bound, limit = ({name: in_words(item) for name, item in found.items()} for found in (row.bound, row.limit))
        return cls(bound, row.order, limit, row.except_at, row.only)


def in_words(bound: Tolerance) -> str:
    """A tolerance with its unit: ``1e-3 m``, ``0.1 % of its scale``."""
    if bound.relative:
        return f"{100 * bound.value:g} % of its scale"
    return f"{number(bound.value, 6)} {unit(bound.unit)}".strip()
