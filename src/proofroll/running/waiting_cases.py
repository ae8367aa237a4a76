"""Cases that wait for a worker, by engine."""

from __future__ import annotations

import threading
from collections import deque

from proofroll.running.case import Case
from proofroll.running.time_budget import TimeBudget


class WaitingCases:
    """Cases that wait. A worker goes on with its engine while it can: starting another costs more than many a case.

    Args:
        budget: of the processor time of the cases, or None.
    """

    def __init__(self, budget: TimeBudget | None = None) -> None:
        self.budget = budget
        self._changed = threading.Condition()
        self._by_engine: dict[str, deque[Case]] = {}
        self._begun: set[str] = set()
        self._closed = False

    def add(self, case: Case) -> None:
        """Puts a case at the end."""
        if self.budget:
            self.budget.wait()
        with self._changed:
            self._by_engine.setdefault(case.engine.name, deque()).append(case)
            self._changed.notify()

    def close(self) -> None:
        """Nothing more will come, and what waits is not to be begun."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def take(self, engine: str | None) -> Case | None:
        """Next case, of this engine if it has one, else of one that no worker has begun; None: it is closed.

        Where all are begun, the one with the most cases left is shared. Where there is none, it waits for one.
        """
        with self._changed:
            while not self._closed:
                group = self._by_engine.get(engine or "")
                if not group:
                    fresh = [cases for name, cases in self._by_engine.items() if cases and name not in self._begun]
                    group = max(fresh or self._by_engine.values(), key=len, default=None)
                if group:
                    case = group.popleft()
                    self._begun.add(case.engine.name)
                    return case
                self._changed.wait()
            return None
