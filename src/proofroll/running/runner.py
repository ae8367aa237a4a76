"""Runs cases in worker processes and survives their crashes."""

from __future__ import annotations

import dataclasses
import os
import queue
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from proofroll.core.errors import InputError, Missing, ProofrollError, Unwritable
from proofroll.core.plugins import plain_name
from proofroll.files.atomic import is_unwritable_here
from proofroll.running.case import Case, Result, Status
from proofroll.running.engine_questions import lent_workers
from proofroll.running.idle_workers import Workers
from proofroll.running.process import Worker, WorkerDied, status_of
from proofroll.running.store import Store
from proofroll.running.time_budget import ProcessorProfile, TimeBudget

if TYPE_CHECKING:
    from proofroll.running.cluster import Cluster


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


_Arrived = queue.SimpleQueue[tuple[Case, Result] | Exception]


class Runner:
    """Runs cases side by side, reuses stored results, and always returns one result per case.

    Args:
        store: keeper of the results.
        jobs: number of workers at once.
        fresh: run every case again, once, though its result is stored.
        cluster: runs the cases; None: this machine does. Engines are asked and speeds measured on this machine always.
        workers: processes that may have loaded an engine already; None: new ones.

    Raises:
        InputError: ``jobs`` is no whole number from 1 on.
    """

    def __init__(
        self,
        store: Store,
        jobs: int | None = None,
        fresh: bool = False,
        cluster: Cluster | None = None,
        workers: Workers | None = None,
    ) -> None:
        if jobs is not None and not (isinstance(jobs, int) and jobs >= 1):
            raise InputError("jobs", jobs, "give the number of workers at once, at least 1")
        self.store = store
        self.cluster = cluster
        self.workers = workers or Workers()
        """Idle workers, also for questions of the same study to engines."""
        self.profile = ProcessorProfile()
        """Processor time by phase."""
        self.jobs = jobs or os.cpu_count() or 1
        self.fresh = fresh
        self.reused = 0
        self.damaged: set[str] = set()
        """Keys of the cases that were run again because their stored results were damaged."""
        self.hosts: Counter[str] = Counter()
        """Machine -> number of results that it made, stored ones included; an empty name is this machine."""
        self._run_here: set[str] = set()
        self._stopping = threading.Event()

    def run(
        self,
        cases: Iterable[Case],
        progress: Callable[[Case, Result], None] | None = None,
        budget: TimeBudget | None = None,
        priority: Mapping[str, int] = MappingProxyType({}),
    ) -> dict[str, Result]:
        """Results of cases, by key.

        Args:
            cases: to be run.
            progress: called in this thread with each case and result as it arrives.
            budget: processor time of all cases; cases beyond it are left out.
            priority: see :meth:`follow`.
        """

        def no_more(case: Case, result: Result) -> tuple[()]:
            if progress:
                progress(case, result)
            return ()

        return self.follow(cases, no_more, budget, priority)

    def follow(
        self,
        cases: Iterable[Case],
        then: Callable[[Case, Result], Iterable[Case]],
        budget: TimeBudget | None = None,
        priority: Mapping[str, int] = MappingProxyType({}),
    ) -> dict[str, Result]:
        """Results of cases as by :meth:`run`, where each result may lead to further cases, which begin at once.

        Args:
            cases: the first ones.
            then: called in this thread as each result arrives; returns cases that have not been asked for yet.
            budget: processor time of cases on this machine; a cluster has none.
            priority: key of a case -> number; cases with a smaller number are all begun before others.
        """
        results: dict[str, Result] = {}
        asked: set[str] = set()
        arrived: _Arrived = queue.SimpleQueue()
        shared = WaitingCases(budget, priority)
        running = 0
        ready: deque[tuple[Case, Result]] = deque()

        def ask(case: Case) -> int:
            """Number of answers that are still to arrive for a case: 1, or 0 if its result is there already."""
            if case.key in asked:
                return 0
            asked.add(case.key)
            is_new = not self.fresh or case.key in self._run_here
            stored = self.store.get(case) if is_new else None
            if stored is None or self._lacks_speed(case, stored):
                if is_new and stored is None and self.store.has(case):
                    self.damaged.add(case.key)
                shared.add(case)
                return 1
            self.reused += 1
            ready.append((case, stored))
            return 0

        pool = ThreadPoolExecutor(self.jobs)
        try:
            running += sum([ask(case) for case in cases])
            serving = False
            while ready or running:
                if running and not serving:
                    serving = True
                    self._begin(pool, shared, arrived)
                if ready:
                    case, result = ready.popleft()
                else:
                    item = arrived.get()
                    if isinstance(item, Exception):
                        raise item
                    running -= 1
                    case, result = item
                    self._run_here.add(case.key)
                    result = self._remarked(case, result)
                results[case.key] = result
                self.hosts[result.host] += 1
                running += sum([ask(further) for further in then(case, result)])
        except BaseException:
            shared.close()
            self._stop()
            raise
        finally:
            shared.close()
            pool.shutdown(wait=True, cancel_futures=True)
            self._stopping.clear()
        return results

    def _remarked(self, case: Case, result: Result) -> Result:
        """Result of a case that was run just now, booked in the profile, with a remark on a damaged earlier one."""
        self.profile.add(result)
        if case.key not in self.damaged:
            return result
        return dataclasses.replace(result, message=f"{result.message}; what was stored was damaged")

    def _begin(self, pool: ThreadPoolExecutor, waiting: WaitingCases, arrived: _Arrived) -> None:
        """Starts serving the waiting cases, on the cluster or in workers of this machine."""
        if self.cluster is not None:
            pool.submit(self.cluster.serve, waiting.take, partial(self._arrive, arrived), arrived.put)
            return
        for _ in range(self.jobs):
            pool.submit(self._serve, waiting, arrived)

    def _stop(self) -> None:
        """Ends all running cases, on this machine and on the cluster."""
        self._stopping.set()
        self.workers.kill()
        if self.cluster is not None:
            self.cluster.stop()

    def _next(self, waiting: WaitingCases, engine: str | None, arrived: _Arrived) -> tuple[Case, float] | None:
        """Next case and its time limit [s]; None: there are no more, or the runner stops."""
        while not self._stopping.is_set() and (case := waiting.take(engine)) is not None:
            if not (budget := waiting.budget):
                return case, case.time_limit
            if limit := budget.begin(case.key, self.jobs):
                return case, min(case.time_limit, limit)
            budget.end(case.key)
            arrived.put((case, Result(Status.LEFT_OUT, budget.sentence)))
        return None

    def _serve(self, waiting: WaitingCases, arrived: _Arrived) -> None:
        """Serves cases one after another, as long as there are any of one engine, whose worker is lent again."""
        engine: str | None = None
        try:
            while (taken := self._next(waiting, engine, arrived)) is not None:
                case, limit = taken
                engine = case.engine.name
                self._arrive(arrived, case, partial(self._in_worker, waiting.budget, case, limit))
        except Exception as error:
            arrived.put(error)
            self._stopping.set()

    def _in_worker(self, budget: TimeBudget | None, case: Case, limit: float, out: Path) -> Result:
        """Result of a case whose processor time is charged to a budget; beyond its share the case is left out."""
        began, used, ended = None, 0.0, False
        if budget and case.engine.steps:  # a reference by steps keeps what it has
            case = dataclasses.replace(case, time_limit=min(case.time_limit, limit))
        try:
            with self.workers.lend(case.engine.name) as worker:
                if self._stopping.is_set():  # _stop may have run before this worker was in the pool
                    raise WorkerDied(Status.CRASHED, "the run was stopped")
                began = worker.used
                try:
                    return _ask(worker, case, limit, out)
                finally:
                    used = worker.used - began
        except InputError as error:
            if began is None:  # the engine's interpreter is gone meanwhile
                raise Missing(str(error)) from None
            raise
        except WorkerDied as error:
            ended = True
            if budget and error.status is Status.TIMEOUT and limit < case.time_limit:
                raise WorkerDied(Status.LEFT_OUT, budget.sentence) from None
            raise
        finally:
            if budget:
                budget.end(case.key, used, ended=ended)

    def _lacks_speed(self, case: Case, stored: Result) -> bool:
        """True if a stored result has no speed only because a cluster made it; the case is then run on this machine."""
        return bool(case.timed and stored.host and stored.status == Status.DONE and self.cluster is None)

    def _arrive(self, arrived: _Arrived, case: Case, make: Callable[[Path], Result]) -> None:
        """Stores and delivers the result of a case, or its failure."""
        try:
            result = self._result(case, make)
        except Unwritable as error:  # a full disk affects every case, so it ends the run
            arrived.put(error)
            return
        except ProofrollError as error:  # affects this case only
            if isinstance(error, WorkerDied) and self._stopping.is_set():
                return
            result = result_without_answer(case, error)
        arrived.put((case, result))

    def _result(self, case: Case, make: Callable[[Path], Result]) -> Result:
        """Stored result of a case; ``make`` writes its trajectory to a file and returns the result."""
        with self.store.incoming(case) as written:
            try:
                result = make(written)
            except InputError as error:  # affects this case only, for example a step that does not divide the grid
                result = result_without_answer(case, error)
            except WorkerDied as error:  # show the final name of the file, not the temporary one
                shown = str(error).replace(str(written.absolute()), str(self.store.trajectory(case)))
                raise WorkerDied(error.status, shown) from None
            except Unwritable as error:
                shown = str(error).replace(str(written.absolute()), str(self.store.trajectory(case)))
                shown = shown.replace("another path", "another folder with --out")
                raise Unwritable(shown, error.number, error.reason) from None
            return self.store.put(case, result, written)


def _ask(worker: Worker, case: Case, limit: float, out: Path) -> Result:
    request = {"do": "run", "case": dataclasses.asdict(case), "out": str(out.absolute())}  # an engine may change folder
    try:
        result = Result.from_dict(worker.request(request, limit))
        name = plain_name(case.engine.name)
        ran = result.versions.get(name)
        if ran != case.engine.version:
            raise WorkerDied(Status.CRASHED, f"version {ran} of {name} ran, and {case.engine.version} had answered")
        waited = worker.waited - sum(result.spent.values())  # start of the process and transfer of messages
        return dataclasses.replace(result, spent=result.spent | {"process start": waited})
    except Missing as error:
        return Result(Status.MISSING, str(error))
    except Unwritable as error:
        if is_unwritable_here(out.parent, error):
            raise
        raise WorkerDied(Status.CRASHED, f"its process could not write a file any more ({error.reason})") from None


def result_without_answer(case: Case, error: ProofrollError) -> Result:
    """Result of a case without an answer of its worker; the error is its message."""
    return Result(status_of(error), str(error), versions={plain_name(case.engine.name): case.engine.version})


def run_one(case: Case, out: Path, workers: Workers | None = None) -> Result:
    """Result of a single case, with its trajectory in ``out``; nothing is stored or reused."""
    try:
        with lent_workers(workers) as lent, lent.lend(case.engine.name) as worker:
            return _ask(worker, case, case.time_limit, out)
    except WorkerDied as error:
        return result_without_answer(case, error)
