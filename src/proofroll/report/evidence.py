"""What a comparison's section shows besides verdicts: all that is claimed, and cost with intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from proofroll.running.timing import Timing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from proofroll.core.comparison import Row, Tolerance


def cost(timings: Sequence[float]) -> dict[str, Any] | None:
    """Wall seconds per simulated second: ``median``, ``low`` and ``high``, their ``confidence``, and ``runs``.

    One run has no interval: ``low``, ``high`` and ``confidence`` are None.
    """
    if not timings:
        return None
    interval = Timing(tuple(timings)).interval
    ends: dict[str, Any] = {"low": interval.low, "high": interval.high, "confidence": interval.confidence}
    if not interval.confidence:
        ends = dict.fromkeys(ends)
    return {"median": interval.value, **ends, "runs": len(timings)}


def claims(row: Row) -> dict[str, Any]:
    """What is expected of a row besides its verdict: bounds of its own, orders, limits, and other points' verdicts."""
    return {
        "bound": {name: _text(bound) for name, bound in row.bound.items()},
        "order": {name: list(ends) for name, ends in row.order.items()},
        "limit": {name: _text(bound) for name, bound in row.limit.items()},
        "except_at": [{"where": item.where, "expect": list(item.expect)} for item in row.except_at],
        "only": row.only,
    }


def _text(bound: Tolerance) -> str:
    return f"{100 * bound.value:g} % of its scale" if bound.relative else f"{bound.value:g} {bound.unit}"
