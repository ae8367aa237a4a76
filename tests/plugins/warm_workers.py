"""Worker processes shared by all tests of a pytest process: starting one costs more than most requests to it.

A worker is lent again if its engine, its memory limit and the environment are those with which it started; it changes
to the test's folder. All engines of ``ENTRY_POINTS`` load the same libraries, so one worker serves them all until one
of them ends it. Tests of worker processes themselves are marked ``own_workers`` and share none.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from weakref import WeakKeyDictionary

import pytest
from hostile import ENTRY_POINTS

from proofroll.running import process
from proofroll.running.idle_workers import Workers
from proofroll.running.process import Worker

# Largest number of idle workers, some hundred MB each; beyond it, the one idle for longest is ended.
_MOST = 12
# Variables that differ from test to test, and that no worker reads.
_PASSING = {"PYTEST_CURRENT_TEST", "COLUMNS"}

# A worker in another interpreter, or one that is no Python at all, stays in the folder in which it began.
_FOLLOW = Path(__file__).with_name("follow.py")

_Place = tuple[str, float | None, str, frozenset[tuple[str, str]]]


def _environment(variables: Mapping[str, str]) -> frozenset[tuple[str, str]]:
    return frozenset(item for item in variables.items() if item[0] not in _PASSING)


def _loaded(engine: str) -> str:
    return "hostile" if engine in ENTRY_POINTS else engine


def _follow(worker: Worker) -> None:
    arguments = {"path_name": str(_FOLLOW), "init_globals": {"folder": os.getcwd()}}
    worker.ask({"do": "call", "function": "runpy:run_path", "arguments": arguments}, 60)


class WarmWorkers:
    """Pool of idle workers."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._idle: list[tuple[_Place, Worker]] = []
        self._began: WeakKeyDictionary[Worker, _Place] = WeakKeyDictionary()
        self._started = threading.local()

    @contextmanager
    def lent(self) -> Iterator[None]:
        """Context in which workers are taken from this pool, and returned to it instead of ended."""
        take, safe = Workers.take, process.safe_environment

        def noted() -> dict[str, str]:
            self._started.environment = safe()
            return self._started.environment

        def warm(workers: Workers, engine: str) -> Worker:
            where = _loaded(engine), workers._memory, os.getcwd() if "@" in engine else ""
            place = (*where, _environment(safe()))
            idle = next((name for name, _ in workers._idle if _loaded(name) == place[0]), None)
            found = self._take(place) if idle is None else None
            if found and "@" not in engine:
                _follow(found)
            self._started.environment = None
            worker = found or take(workers, idle or engine)
            workers._made.add(worker)
            # A thread that a test has left behind starts it after that test, in another environment than it looked for.
            if self._started.environment is not None:
                self._began.setdefault(worker, (*where, _environment(self._started.environment)))
            return worker

        def give_back(idle: list[tuple[str, Worker]]) -> None:
            while idle:
                self._keep(*idle.pop())

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Workers, "take", warm)
            patch.setattr(process, "safe_environment", noted)
            patch.setattr("proofroll.running.idle_workers._close", give_back)
            yield

    def _take(self, place: _Place) -> Worker | None:
        while True:
            with self._lock:
                index = next((index for index, (where, _) in enumerate(self._idle) if where == place), None)
                worker = None if index is None else self._idle.pop(index)[1]
            if worker is None or not worker._ended():
                return worker
            worker.close()  # a test of what an interrupt does ended all workers of this process, these among them

    def _keep(self, engine: str, worker: Worker) -> None:
        place = self._began.get(worker)
        if place is None or place[0] != _loaded(engine) or worker._ended():
            worker.close()
            return
        # A finalizer may run while its own thread holds the lock: to wait for it would be for ever.
        if not self._lock.acquire(blocking=False):
            worker.close()
            return
        try:
            self._idle.append((place, worker))
            surplus = [self._idle.pop(0)[1]] if len(self._idle) > _MOST else []
        finally:
            self._lock.release()
        for old in surplus:
            old.close()

    def close(self) -> None:
        """Ends all idle workers."""
        while self._idle:
            self._idle.pop()[1].close()
