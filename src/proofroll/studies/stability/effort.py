"""Effort that a stability map may take: values per axis, steps and time of a run, also of a quick map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from proofroll.core.validation import FloatOrInf
from proofroll.studies.stability.axes import Axis


@dataclass(frozen=True)
class Effort:
    """Limits on the cost of a map.

    Attributes:
        periods: length of every run in natural times, unless the axis decides it.
        values: largest number of values per axis, or None.
        steps: largest number of fixed steps of a run. Steps are counted rather than seconds, so that every machine
            searches the same rungs.
        seconds: longest processor time of a run with a fixed step, as its coarsest run foretells [s].
        limit: wall time after which a run is ended [s], with the start of its worker; its outcome stays open.
        longest: longest run that an axis may have, in natural times; None: any.
        matched: True if only the matched settings of each formulation are mapped, or its first ones without matched.
    """

    periods: float = 3.0
    values: int | None = None
    steps: int = 75_000
    seconds: FloatOrInf = math.inf
    limit: float = 15.0
    longest: float | None = None
    matched: bool = False

    def values_of(self, axis: Axis) -> list[float]:
        """Values of an axis that are mapped."""
        cut = axis.horizon and self.longest is not None
        values = [value for value in axis.values if value <= self.longest] if cut else axis.values  # type: ignore[operator]
        return evenly_chosen(values, self.values) if self.values else values


# A quick map leaves out the longest runs and the finest steps, which take most of the time. A step costs 5 microseconds
# in one engine and a millisecond in another, so that steps alone bound no time.
QUICK = Effort(values=3, steps=2_500, seconds=0.8, limit=3.0, longest=10.0, matched=True)


def evenly_chosen(values: Sequence[float], count: int) -> list[float]:
    """Selection of at most ``count`` of the values, evenly spread, with both ends."""
    if len(values) <= count:
        return list(values)
    last = len(values) - 1
    return [values[round(index * last / (count - 1))] for index in range(count)]
