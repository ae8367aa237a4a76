"""Impacts that follow each other faster and faster, as of a rocking block: the sum of their geometric series."""

from typing import NamedTuple

_LONGEST = 8  # impacts of one cycle at most
# Difference of the ratios of speeds and of intervals up to which a series is geometric: 5e-5 is seen, of round-off in
# intervals of 1e-6 natural times, and both differ by the speed itself.
_ALIKE = 1e-2


class Impact(NamedTuple):
    """An impact: its time, the contacts that it hits, and their closing speed, in natural units."""

    time: float
    contacts: frozenset[int]
    speed: float


class GeometricSeries(NamedTuple):
    """Infinitely many impacts still to come.

    Attributes:
        ratio: of the speeds of an impact and of that one cycle before.
        remaining: time until all are over.
        period: duration of the last cycle.
        contacts: all that were hit in it.
    """

    ratio: float
    remaining: float
    period: float
    contacts: frozenset[int]


class ImpactSeries:
    """Impacts of a motion so far, by pairs: those of one pair repeat in cycles where they accumulate.

    Between slow impacts forces are constant, so that intervals shrink as speeds do (G. W. Housner, 1963).
    """

    def __init__(self) -> None:
        self._all, self._of_pairs = list[Impact](), dict[str, list[Impact]]()

    def after(self, pair: str, impact: Impact) -> GeometricSeries | None:
        """Series that an impact on a pair belongs to; None: it belongs to none. The impact is kept."""
        self._all.append(impact)
        impacts = self._of_pairs.setdefault(pair, [])
        impacts.append(impact)
        for length in range(1, min(_LONGEST, (len(impacts) - 1) // 2) + 1):
            again = zip(impacts[-length - 1 :], impacts[-2 * length - 1 : -length], strict=True)
            if any(late.contacts != early.contacts for late, early in again):
                continue
            last, middle, earliest = (impacts[-1 - cycles * length] for cycles in range(3))
            period, previous_period = last.time - middle.time, middle.time - earliest.time
            if not 0 <= last.speed < middle.speed:
                continue
            ratio = last.speed / middle.speed
            if period < previous_period and abs(period / previous_period - ratio) <= _ALIKE:
                hit = (entry.contacts for entry in self._all if entry.time > middle.time)
                return GeometricSeries(ratio, period * ratio / (1 - ratio), period, frozenset().union(*hit))
        return None
