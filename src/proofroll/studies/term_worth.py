"""Whether a term of a model is worth its price: what leaving it out does to the answer, and what it costs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from proofroll.running.timing import Interval, named

# A ratio of costs below this is nothing to be saved.
_FELT = 1.02
# A change by this part of the quantity's size is round-off that has grown: nobody's answer hangs on it.
_ROUND_OFF = 1e-9


class Worth(StrEnum):
    """What a term is worth; the value is what a person reads."""

    NEEDED = "needed"
    NOT_NEEDED = "paid for, not needed"
    FREE = "free"
    HARMFUL = "harmful"
    INHERENT = "inherent"
    NO_ANSWER = "no answer"


@dataclass(frozen=True)
class Side:
    """The quantity with a term, or without it.

    Attributes:
        error: distance from the truth, which has the term; None: there is no answer.
        said: how the run ended.
    """

    error: float | None
    said: str


def worth_of_term(
    on: Side,
    off: Side,
    change: float | None,
    cost: Interval | None,
    *,
    tolerance: float | None,
    bar: float,
    scale: float,
) -> tuple[Worth, str]:
    """The verdict, and why.

    A term moves the answer if leaving it out changes the quantity by more than is allowed: by the tolerance, or where
    none is given by the smaller of the two errors, and by more than round-off; never by less than the truth's error
    bar.

    Args:
        on: with the term.
        off: without it.
        change: of the quantity between the two; None if one of them has no answer.
        cost: how many times longer it takes with the term; None if that is not known.
        tolerance: error that is allowed; None: whatever is left anyway.
        bar: error bar of the truth.
        scale: size of the quantity.
    """
    if on.error is None or on.error > scale:
        said = on.said if on.error is None else f"the answer is off by {on.error:.2g}, more than its whole size"
        return Worth.NO_ANSWER, f"with it: {said}"
    if off.error is None or change is None:
        return Worth.NEEDED, f"without it: {off.said}"
    limit = max(bar, max(min(on.error, off.error), _ROUND_OFF * scale) if tolerance is None else tolerance)
    allowed = f"the tolerance, {limit:.2g}" if tolerance is not None else f"the error that is left anyway, {limit:.2g}"
    if change > limit:
        if off.error > on.error:
            return Worth.NEEDED, f"without it the answer moves by {change:.2g}, more than {allowed}"
        return Worth.HARMFUL, f"without it the error falls from {on.error:.2g} to {off.error:.2g}"
    moved = f"without it the answer moves by {change:.2g}, no more than {allowed}"
    if cost is None:
        return Worth.FREE, f"{moved}; its price is not known"
    price = (
        f"it takes {cost.value:.2f} times as long with it ({cost.low:.2f} … {cost.high:.2f}, {named(cost.confidence)})"
    )
    return (Worth.NOT_NEEDED if cost.low > _FELT else Worth.FREE), f"{moved}; {price}"
