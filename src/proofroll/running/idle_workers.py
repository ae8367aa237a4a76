"""Pool of idle worker processes, by the engine that they have loaded, as starting one costs more than many a case."""

import math
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict

from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.running.case import Case
from proofroll.running.interpreters import start
from proofroll.running.process import Worker, WorkerDied

# Most idle workers that are kept, some hundred MB each; beyond it the longest idle one is ended.
MOST = 8
# Default length of a measurement [s]: long enough for the clock and the caches, short enough for many rounds.
SECONDS = 0.05


class Workers:
    """Pool of idle workers by engine. They end with this object, or with this process.

    Args:
        memory: limit for each [GB]; by default :func:`proofroll.running.memory.memory_limit`.
        most: largest number of idle workers.
        patience: wall time within which an engine has to answer a question about itself [s].

    Attributes:
        silent: engines that did not answer in time, which are not asked again.
    """

    def __init__(self, memory: float | None = None, most: int = MOST, patience: float = math.inf) -> None:
        self._memory, self._most = memory, most
        self.patience, self.silent = patience, dict[str, WorkerDied]()
        self._lock = threading.Lock()
        self._idle: list[tuple[str, Worker]] = []
        self._made: weakref.WeakSet[Worker] = weakref.WeakSet()
        self._end = weakref.finalize(self, _close, self._idle)

    def take(self, engine: str) -> Worker:
        """Last idle worker that has this engine loaded, or a new one.

        Raises:
            InputError, Missing, WorkerDied: the engine's interpreter does not serve, see :func:`interpreters.start`.
        """
        with self._lock:
            for index in reversed(range(len(self._idle))):
                if self._idle[index][0] == engine:
                    return self._idle.pop(index)[1]
        worker = start(engine, self._memory)
        with self._lock:
            self._made.add(worker)
        return worker

    def keep(self, engine: str, worker: Worker) -> None:
        """Takes back a worker that has answered all its requests."""
        with self._lock:
            self._idle.append((engine, worker))
            surplus = [self._idle.pop(0)[1]] if len(self._idle) > self._most else []
        for old in surplus:
            old.close()

    def rename(self, asked: str, engine: str) -> None:
        """Files idle workers of ``asked`` under ``engine``: they were started before the engine was known."""
        with self._lock:
            self._idle[:] = [(engine if name == asked else name, worker) for name, worker in self._idle]

    @contextmanager
    def lend(self, engine: str) -> Iterator[Worker]:
        """Context manager that lends a worker for this engine; it is kept unless it failed to answer."""
        worker = self.take(engine)
        try:
            yield worker
        except (InputError, Missing):
            self.keep(engine, worker)
            raise
        except BaseException:
            worker.close()
            raise
        self.keep(engine, worker)

    def speed(self, case: Case, seconds: float | None = None) -> float | None:
        """Wall time per simulated second of a case, from clean runs that only advance; None: they failed.

        The runs take ``seconds`` of wall time, by default :data:`SECONDS`, in the last idle worker of the engine.
        """
        request = {"do": "time", "case": asdict(case), "seconds": seconds or SECONDS}
        try:
            with self.lend(case.engine.name) as worker:
                rate = worker.ask(request, STUDY_TIME_LIMIT).get("seconds_per_second")
        except ProofrollError:  # the engine's process died, or its interpreter is gone
            return None
        return None if rate is None else float(rate)

    def close(self) -> None:
        """Ends the idle workers."""
        with self._lock:
            _close(self._idle)

    def kill(self) -> None:
        """Kills all workers that were made here, lent ones, too; threads that wait for one get WorkerDied."""
        with self._lock:
            made = list(self._made)
        for worker in made:
            worker.kill()
        self.close()


def _close(idle: list[tuple[str, Worker]]) -> None:
    while idle:
        idle.pop()[1].close()
