"""Worker processes that are kept for the engine they have loaded: starting another costs more than many a case."""

import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager

from proofroll.core.errors import InputError, Missing
from proofroll.running.interpreters import start
from proofroll.running.process import Worker

# Idle workers that are kept, some hundred MB each; of more, the one that has waited longest is ended.
MOST = 8


class Workers:
    """Idle workers by engine, at most ``most`` in all. They end with this object, and at the latest with this process.

    Each may have so much ``memory`` [GB], by default :func:`proofroll.running.memory.memory_limit`.
    """

    def __init__(self, memory: float | None = None, most: int = MOST) -> None:
        self._memory, self._most = memory, most
        self._lock = threading.Lock()
        self._idle: list[tuple[str, Worker]] = []
        self._made: weakref.WeakSet[Worker] = weakref.WeakSet()
        self._end = weakref.finalize(self, _close, self._idle)

    def take(self, engine: str) -> Worker:
        """A worker that has this engine loaded, or a new one.

        Raises:
            InputError, Missing, WorkerDied: the engine's interpreter does not serve, see :func:`interpreters.start`.
        """
        with self._lock:
            for index, (name, _) in enumerate(self._idle):
                if name == engine:
                    return self._idle.pop(index)[1]
        worker = start(engine, self._memory)
        with self._lock:
            self._made.add(worker)
        return worker

    def keep(self, engine: str, worker: Worker) -> None:
        """Takes back a worker that has answered all that it was asked."""
        with self._lock:
            self._idle.append((engine, worker))
            surplus = [self._idle.pop(0)[1]] if len(self._idle) > self._most else []
        for old in surplus:
            old.close()

    def rename(self, asked: str, engine: str) -> None:
        """Enters an idle worker under its ``engine``; it was started as ``asked``, before that was known."""
        with self._lock:
            self._idle[:] = [(engine if name == asked else name, worker) for name, worker in self._idle]

    @contextmanager
    def lend(self, engine: str) -> Iterator[Worker]:
        """A worker for this engine; it is kept if it has answered, be it with what is wrong or missing."""
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

    def close(self) -> None:
        """Ends the idle workers."""
        with self._lock:
            _close(self._idle)

    def kill(self) -> None:
        """Ends all workers that were made here, lent ones among them: a process that waits for one sees it died."""
        with self._lock:
            made = list(self._made)
        for worker in made:
            worker.kill()
        self.close()


def _close(idle: list[tuple[str, Worker]]) -> None:
    while idle:
        idle.pop()[1].close()
