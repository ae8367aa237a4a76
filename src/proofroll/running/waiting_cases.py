"""Cases that wait for a worker, by engine."""

import threading
from collections import deque
from collections.abc import Mapping
from types import MappingProxyType

from proofroll.running.case import Case
from proofroll.running.time_budget import TimeBudget


class WaitingCases:
    """Cases that wait for a worker, which keeps its engine while it can: a new worker costs more than many cases.

    Args:
        budget: of the processor time of the cases, or None.
        place: of cases by key, 0 without; those of an earlier place are all begun before one of a later place is.
    """

    def __init__(self, budget: TimeBudget | None = None, place: Mapping[str, int] = MappingProxyType({})) -> None:
        self.budget = budget
        self._place = place
        self._changed = threading.Condition()
        self._by_engine: dict[int, dict[str, deque[Case]]] = {}
        self._begun: set[tuple[int, str]] = set()
        self._closed = False

    def add(self, case: Case) -> None:
        """Puts a case at the end."""
        if self.budget:
            self.budget.wait(case.key)
        with self._changed:
            groups = self._by_engine.setdefault(self._place.get(case.key, 0), {})
            groups.setdefault(case.engine.name, deque()).append(case)
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
                at = min((place for place, groups in self._by_engine.items() if any(groups.values())), default=None)
                if at is not None:
                    groups = self._by_engine[at]
                    group = groups.get(engine or "")
                    if not group:
                        fresh = [cases for name, cases in groups.items() if cases and (at, name) not in self._begun]
                        group = max(fresh or groups.values(), key=len)
                    case = group.popleft()
                    self._begun.add((at, case.engine.name))
                    return case
                self._changed.wait()
            return None
