"""Processor time of a command by what it was spent on, its workers included."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

from proofroll.running.case import Result
from proofroll.running.process import processor_seconds

# Phases to which parts of cases belong, wherever these were run.
START, TRUTHS, TIMING = "start", "truths", "timing rounds"
# Phases of this process alone, during which its workers go on with the phase around them.
_HERE = ("judging", "page")
_OF_CASES = {"process start": START, "loading": START, "truth": TRUTHS, "clean runs": TIMING}


class ProcessorProfile:
    """Processor time by phase.

    Attributes:
        phases: phase -> processor time without that of phases within it [s].
        activities: activity of the workers in cases -> processor time [s].
    """

    def __init__(self) -> None:
        self.phases: dict[str, float] = defaultdict(float)
        self.activities: dict[str, float] = defaultdict(float)
        self._open = [START]
        self._since = 0.0, 0.0

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Context manager of a phase; within another its time is taken off that one."""
        self._book()
        self._open.append(name)
        try:
            yield
        finally:
            self._book()
            self._open.pop()

    def add(self, result: Result) -> None:
        """Books the parts of a case that was run just now: its truth, clean runs and start are phases of their own."""
        for activity, seconds in result.processor.items():
            self.activities[activity] += seconds
            if (phase := _OF_CASES.get(activity)) is not None:
                self.phases[phase] += seconds
                self.phases[self._open[-1]] -= seconds

    @property
    def total(self) -> float:
        """Processor time so far [s]."""
        self._book()
        return sum(self.phases.values())

    def _book(self) -> None:
        """Books the time since the last call on the innermost open phase; that of workers on the one that has them."""
        own_seconds = time.process_time()
        workers = processor_seconds() - own_seconds
        self.phases[self._open[-1]] += own_seconds - self._since[0]
        working = next(name for name in reversed(self._open) if name not in _HERE)
        self.phases[working] += workers - self._since[1]
        self._since = own_seconds, workers
