"""Processor time that the cases of one study may take together, for studies that would rather leave something out."""

import threading
import time
from collections import Counter, defaultdict
from collections.abc import Mapping
from types import MappingProxyType

from proofroll.running.process import processor_seconds

# Part of the seconds that is kept for reading and judging what comes of the cases, until it is known what that takes.
_AFTER = 0.1
# A case with less time than it takes to start a process is not begun [s].
_LEAST = 0.5
# Least share of a group, as far as so much is left [s]: enough for a truth and the first runs. With less no group would
# finish anything, and the same command would begin the same runs again.
_SHARE = 10.0


class TimeBudget:
    """Processor time of the cases of one study; what it does not suffice for is left out.

    Cases belong to groups, as the comparisons of a report. A group that begins gets an equal part of the time left,
    but at least what a truth needs; what it leaves over is for later groups. A case gets an equal part of its group's
    time among the cases of the group that run now, and never more than an equal part of the time left among all that
    run: so the sum is never exceeded. A case that was ended begins again, and only with more time.

    Args:
        seconds: of processor time, that of this process included [s].
        spent: those of them that asking the engines has taken already [s].
        group: of cases by key; all others are one.

    Attributes:
        after: processor time that is kept for what comes after the cases [s].
    """

    def __init__(self, seconds: float, spent: float = 0.0, group: Mapping[str, int] = MappingProxyType({})) -> None:
        self.seconds, self.after = seconds, _AFTER * seconds
        self._start, self._lost = processor_seconds() - spent, 0.0
        self._group = group
        self._begun: dict[str, tuple[float, float]] = {}
        self._unfinished: Counter[int] = Counter()
        self._shares: dict[int, float] = {}
        self._used: defaultdict[int, float] = defaultdict(float)
        self._allowed: defaultdict[str, float] = defaultdict(float)
        self._lock = threading.Lock()

    @property
    def sentence(self) -> str:
        """Reason that a case is left out."""
        return f"the {self.seconds:g} s of processor time did not suffice"

    @property
    def left(self) -> float:
        """Processor time that is left for cases [s]."""
        with self._lock:
            return self._left()

    def _left(self) -> float:
        """See :attr:`left`; under the lock."""
        used = processor_seconds() - self._start + self._lost + sum(map(self._passed, self._begun))
        return max(0.0, self.seconds - self.after - used)

    def _passed(self, case: str) -> float:
        """Seconds of a case that has begun: by the wall, where others may have the processor, but what it may take."""
        begun, allowed = self._begun[case]
        return min(time.monotonic() - begun, allowed)

    def wait(self, case: str) -> None:
        """Counts one more case that waits for a worker."""
        with self._lock:
            self._unfinished[self._group.get(case, 0)] += 1

    def begin(self, case: str, abreast: int) -> float:
        """Seconds that a case may take beside at most ``abreast`` - 1 others; 0: it is not to be begun."""
        group = self._group.get(case, 0)
        with self._lock:
            left = self._left()
            share = self._shares.setdefault(group, max(left / len(self._unfinished), min(_SHARE, left)))
            others = [key for key in self._begun if self._group.get(key, 0) == group]
            share -= self._used[group] + sum(self._begun[key][1] for key in others)
            together = min(abreast, self._unfinished[group]) - len(others)
            seconds = min(left / max(1, min(abreast, self._unfinished.total())), share / max(1, together))
            seconds = seconds if seconds > max(_LEAST, self._allowed[case]) else 0.0
            self._begun[case] = time.monotonic(), seconds
            self._allowed[case] = max(seconds, self._allowed[case])
            return seconds

    def end(self, case: str, used: float = 0.0, *, lost: bool = False) -> None:
        """Counts a case that has ended.

        Args:
            case: its key.
            used: its processor time [s].
            lost: it has none, and counts by its wall time, but by no more than it was allowed.
        """
        group = self._group.get(case, 0)
        with self._lock:
            passed = self._passed(case) if lost else 0.0
            del self._begun[case]
            self._lost += passed
            self._used[group] += passed or used
            self._unfinished[group] -= 1
            if not self._unfinished[group]:
                del self._unfinished[group], self._shares[group], self._used[group]
