"""Processor time of a study: its limit, beyond which cases are left out, and what it was spent on."""

import threading
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType

from proofroll.running.case import Result
from proofroll.running.process import processor_seconds

# Part of the budget that is reserved for reading and judging results, until its real cost is known.
_AFTER = 0.1
# Least time for a case [s], about that for starting a process; with less it is not begun.
_LEAST = 0.5
# Least share of a group, if so much is left [s]: enough for a truth and the first runs. With less no group would finish
# anything, and a repeated command would begin the same runs again.
_SHARE = 10.0


class TimeBudget:
    """Processor time for the cases of one study; cases beyond it are left out.

    Cases belong to groups, for example the comparisons of a report. A group that begins gets an equal part of the time
    left, but at least enough for a truth; what it does not use is for later groups. A case gets an equal part of its
    group's time among the group's running cases, and at most an equal part of the time left among all running cases, so
    that the total is never exceeded. A case that was ended for lack of time begins again only with more time.

    Args:
        seconds: processor time, with that of this process [s].
        spent: processor time that was spent on asking engines before [s].
        group: key of a case -> group; all other cases are in group 0.

    Attributes:
        after: processor time that is reserved for the work after the cases [s].
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
        """Reason why a case is left out."""
        return f"the {self.seconds:g} s of processor time did not suffice"

    @property
    def left(self) -> float:
        """Processor time left for cases [s]."""
        with self._lock:
            return self._left()

    def _left(self) -> float:
        """Processor time left for cases [s]; to be called with the lock held."""
        used = processor_seconds() - self._start + self._lost + sum(map(self._passed, self._begun))
        return max(0.0, self.seconds - self.after - used)

    def _passed(self, case: str) -> float:
        """Wall time of a running case [s], but at most its allowed time, as others may have the processor."""
        begun, allowed = self._begun[case]
        return min(time.monotonic() - begun, allowed)

    def wait(self, case: str) -> None:
        """Registers a case that waits for a worker."""
        with self._lock:
            self._unfinished[self._group.get(case, 0)] += 1

    def begin(self, case: str, abreast: int) -> float:
        """Registers the start of a case; returns the time that it may take [s], 0 if it must not begin.

        ``abreast``: largest number of cases that run at once.
        """
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

    def end(self, case: str, used: float = 0.0, *, ended: bool = False) -> None:
        """Registers the end of a case.

        Args:
            case: its key.
            used: its processor time [s].
            ended: True if its process was ended, which may have slept or hung on others: its wall time counts where it
                is longer, but at most the allowed time.
        """
        group = self._group.get(case, 0)
        with self._lock:
            passed = self._passed(case) if ended else 0.0
            del self._begun[case]
            self._lost += max(0.0, passed - used)
            self._used[group] += max(passed, used)
            self._unfinished[group] -= 1
            if not self._unfinished[group]:
                del self._unfinished[group], self._shares[group], self._used[group]


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
