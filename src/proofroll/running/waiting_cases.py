"""Queue of cases that wait for a worker, by engine."""

import threading
from collections import deque
from collections.abc import Mapping
from types import MappingProxyType

from proofroll.running.case import Case
from proofroll.running.time_budget import TimeBudget


class WaitingCases:
    """Queue of cases that wait for a worker.

    A worker gets cases of the same engine while there are any among those with the smallest number: a new worker costs
    more than many cases.

    Args:
        budget: processor time of the cases, or None.
        priority: key of a case -> number, by default 0; cases with a smaller number are all begun before others.
    """

    def __init__(self, budget: TimeBudget | None = None, priority: Mapping[str, int] = MappingProxyType({})) -> None:
        self.budget = budget
        self._priority = priority
        self._changed = threading.Condition()
        self._by_engine: dict[int, dict[str, deque[Case]]] = {}
        self._begun: set[tuple[int, str]] = set()
        self._closed = False

    def add(self, case: Case) -> None:
        """Appends a case."""
        if self.budget:
            self.budget.wait(case.key)
        with self._changed:
            groups = self._by_engine.setdefault(self._priority.get(case.key, 0), {})
            groups.setdefault(case.engine.name, deque()).append(case)
            self._changed.notify()

    def close(self) -> None:
        """Closes the queue: no more cases come, and waiting ones are not begun."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def take(self, engine: str | None) -> Case | None:
        """Next case, preferably of this engine, else of one that no worker has begun; None: the queue is closed.

        If all engines are begun, the one with the most waiting cases is shared. While there is no case, it waits for
        one.
        """
        with self._changed:
            while not self._closed:
                number_of_group = min(
                    (number for number, groups in self._by_engine.items() if any(groups.values())), default=None
                )
                if number_of_group is not None:
                    groups = self._by_engine[number_of_group]
                    group = groups.get(engine or "")
                    if not group:
                        fresh = [
                            cases
                            for name, cases in groups.items()
                            if cases and (number_of_group, name) not in self._begun
                        ]
                        group = max(fresh or groups.values(), key=len)
                    case = group.popleft()
                    self._begun.add((number_of_group, case.engine.name))
                    return case
                self._changed.wait()
            return None
