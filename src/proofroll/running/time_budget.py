"""Processor time that the cases of one study may take together, for studies that would rather leave something out."""

from __future__ import annotations

import threading
import time

from proofroll.running.process import processor_seconds

# Part of the seconds that cases get; the rest is for reading and judging what came of them.
_OF_CASES = 0.9
# A case with less time than it takes to start a process is not begun [s].
_LEAST = 0.5


class TimeBudget:
    """Processor time of the cases of one study; what it does not suffice for is left out.

    Each case may take an equal share of what is left, among those that run side by side, so that all together never
    take more, however long each of them does.

    Args:
        seconds: of processor time, that of this process included [s].
        spent: those of them that asking the engines has taken already [s].
    """

    def __init__(self, seconds: float, spent: float = 0.0) -> None:
        self.seconds = seconds
        self._start, self._lost = processor_seconds() - spent, 0.0
        self._begun: dict[str, float] = {}
        self._unfinished = 0
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
        now = time.monotonic()
        used = processor_seconds() - self._start + self._lost + sum(now - begun for begun in self._begun.values())
        return max(0.0, _OF_CASES * self.seconds - used)

    def wait(self) -> None:
        """Counts one more case that waits for a worker."""
        with self._lock:
            self._unfinished += 1

    def begin(self, case: str, abreast: int) -> float:
        """Seconds that a case may take beside at most ``abreast`` - 1 others; 0: it is not to be begun."""
        with self._lock:
            share = self._left() / max(1, min(abreast, self._unfinished))
            self._begun[case] = time.monotonic()
            return share if share > _LEAST else 0.0

    def end(self, case: str, *, lost: bool = False) -> None:
        """Counts a case that has ended; one that was lost has no processor time, and counts by its wall time."""
        with self._lock:
            begun = self._begun.pop(case)
            self._lost += time.monotonic() - begun if lost else 0.0
            self._unfinished -= 1
