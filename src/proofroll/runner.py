"""Runs cases in worker processes and survives whatever happens there."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import queue
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from proofroll.case import Case, EngineFacts, Result, Status
from proofroll.errors import InputError, Missing, ProofrollError
from proofroll.store import Store

# One thread per worker, set before anything is imported there: workers run side by side.
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"),
    "1",
)
_START_UP_SECONDS = 60.0


class WorkerDied(ProofrollError):  # noqa: N818 -- a fact about the worker, turned into a row of the report
    """The worker process ended without an answer."""

    def __init__(self, status: Status, message: str) -> None:
        self.status = status
        super().__init__(message)


class Worker:
    """A worker process; restarted by making a new one.

    Attributes:
        waited: wall seconds for the last answer; for the first one from the start of the process [s].
    """

    def __init__(self) -> None:
        began = time.perf_counter()
        reader, writer = os.pipe()
        self._log = tempfile.TemporaryFile("w+b")  # noqa: SIM115 -- lives as long as the process
        self._process = subprocess.Popen(
            [sys.executable, "-m", "proofroll.worker", str(writer), str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=self._log,
            stderr=self._log,
            pass_fds=(writer,),
            env=os.environ | _ONE_THREAD,
            text=True,
            start_new_session=True,  # Ctrl-C reaches the parent alone, which then ends its workers
        )
        os.close(writer)
        self._answers = os.fdopen(reader, "rb", buffering=0)
        self._pending = b""
        self._began, self.waited = began, 0.0

    def ask(self, request: Mapping[str, Any], time_limit: float) -> dict[str, Any]:
        """One request, one answer.

        Raises:
            WorkerDied: the process crashed or took longer than ``time_limit`` [s].
        """
        try:
            assert self._process.stdin is not None  # it was opened with a pipe
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except (BrokenPipeError, OSError):
            raise WorkerDied(Status.CRASHED, self._last_words()) from None
        asked = time.perf_counter()
        deadline = time.monotonic() + time_limit
        while b"\n" not in self._pending:
            remaining = deadline - time.monotonic()
            ready = select.select([self._answers], [], [], max(0.0, remaining))[0]
            if not ready:
                self.kill()
                raise WorkerDied(Status.TIMEOUT, f"no result within {time_limit:g} s; it was ended")
            chunk = self._answers.read(65536)
            if not chunk:
                raise WorkerDied(Status.CRASHED, self._last_words())
            self._pending += chunk
        line, _, self._pending = self._pending.partition(b"\n")
        self.waited = time.perf_counter() - (self._began or asked)
        self._began = 0.0
        answer: dict[str, Any] = json.loads(line)
        return answer

    def request(self, request: Mapping[str, Any], time_limit: float) -> dict[str, Any]:
        """As :meth:`ask`, with the errors that the worker met raised here.

        Raises:
            InputError, Missing, WorkerDied: the worker says so, or it ended.
        """
        return _checked(self.ask(request, time_limit))

    def _last_words(self) -> str:
        """How the process ended, and the last line it wrote."""
        code = self._process.wait()
        how = f"ended with exit code {code}" if code >= 0 else f"was killed by {signal.Signals(-code).name}"
        self._log.seek(0)
        lines = self._log.read().decode(errors="replace").strip().splitlines()
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        return f"the engine's process {how}" + (f": {last[:200]}" if last else "")

    def kill(self) -> None:
        """Ends the process at once."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Ends the process."""
        if self._process.poll() is None:
            self.kill()
        if self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
        self._answers.close()
        self._log.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _checked(answer: dict[str, Any]) -> dict[str, Any]:
    """The answer, or the error that the worker met."""
    match answer.get("error"):
        case "input":
            raise InputError(answer["field"], answer["value"], answer["advice"])
        case "missing":
            raise Missing(answer["message"])
        case "crashed":
            raise WorkerDied(Status.CRASHED, answer["message"])
    return answer


def describe(engine: str) -> dict[str, Any]:
    """What an engine is, provides and has as presets; asked in a process of its own.

    Raises:
        InputError, Missing, WorkerDied: it cannot be asked.
    """
    with Worker() as worker:
        return _checked(worker.ask({"do": "describe", "engine": engine}, _START_UP_SECONDS))


def resolve(engines: Sequence[tuple[str, Mapping[str, Any]]]) -> list[EngineFacts | ProofrollError]:
    """Complete settings for engines with options, each or the reason why not, in the order given."""
    found: list[EngineFacts | ProofrollError] = [ProofrollError("not asked")] * len(engines)

    def ask(name: str) -> None:
        worker = Worker()
        for index, (other, options) in enumerate(engines):
            if other != name:
                continue
            request = {"do": "resolve", "engine": name, "options": dict(options)}
            try:
                found[index] = EngineFacts(**_checked(worker.ask(request, _START_UP_SECONDS)))
            except WorkerDied as error:
                found[index] = error
                worker.close()
                worker = Worker()
            except ProofrollError as error:
                found[index] = error
        worker.close()

    # Most of it is the start of the processes and the import of the engines.
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(ask, dict.fromkeys(name for name, _ in engines)))
    return found


class _Waiting:
    """Cases that wait. A worker goes on with its engine while it can: starting another costs more than many a case."""

    def __init__(self, cases: Iterable[Case]) -> None:
        self._lock = threading.Lock()
        self._by_engine: dict[str, deque[Case]] = {}
        for case in cases:
            self._by_engine.setdefault(case.engine.name, deque()).append(case)

    def take(self, engine: str | None) -> Case | None:
        """The next case, of this engine if there is one, else of the one with the most; None: there is none."""
        with self._lock:
            group = self._by_engine.get(engine or "") or max(self._by_engine.values(), key=len, default=None)
            return group.popleft() if group else None


class Runner:
    """Runs cases side by side, reuses stored results, and always returns one result per case.

    Args:
        store: where results are kept.
        jobs: how many workers run at once.
        fresh: run every case again, whatever is stored.
    """

    def __init__(self, store: Store, jobs: int | None = None, fresh: bool = False) -> None:
        self.store = store
        self.jobs = jobs or os.cpu_count() or 1
        self.fresh = fresh
        self.reused = 0
        self._workers: set[Worker] = set()
        self._stopping = threading.Event()

    def run(self, cases: Iterable[Case], progress: Callable[[Case, Result], None] | None = None) -> dict[str, Result]:
        """Results by key of the case. ``progress`` is called in this thread as each arrives."""
        unique = {case.key: case for case in cases}
        results: dict[str, Result] = {}
        waiting: list[Case] = []
        for case in unique.values():
            stored = None if self.fresh else self.store.get(case)
            if stored is None:
                waiting.append(case)
                continue
            self.reused += 1
            results[case.key] = stored
            if progress:
                progress(case, stored)
        arrived: queue.SimpleQueue[tuple[Case, Result] | Exception] = queue.SimpleQueue()
        pool = ThreadPoolExecutor(self.jobs)
        try:
            shared = _Waiting(waiting)
            for _ in range(self.jobs):
                pool.submit(self._serve, shared, arrived)
            for _ in waiting:
                item = arrived.get()
                if isinstance(item, Exception):
                    raise item
                case, result = item
                results[case.key] = result
                if progress:
                    progress(case, result)
        finally:
            self._stopping.set()
            for worker in list(self._workers):
                worker.kill()
            pool.shutdown(wait=True, cancel_futures=True)
            self._stopping.clear()
        return results

    def _serve(self, waiting: _Waiting, arrived: queue.SimpleQueue[tuple[Case, Result] | Exception]) -> None:
        """Serves cases one after another, in a new worker for another engine and after each crash."""
        worker: Worker | None = None
        engine: str | None = None
        try:
            while not self._stopping.is_set() and (case := waiting.take(engine)) is not None:
                if worker is not None and case.engine.name != engine:
                    self._drop(worker)
                    worker = None
                engine = case.engine.name
                if worker is None:
                    worker = Worker()
                    self._workers.add(worker)
                try:
                    result = _ask(worker, case, self.store.trajectory(case))
                except InputError as error:  # a step that does not divide the grid, say: this case's own affair
                    result = Result(Status.REFUSED, str(error), versions={case.engine.name: case.engine.version})
                except WorkerDied as error:
                    result = _lost(case, error)
                    self._drop(worker)
                    worker = None
                    if self._stopping.is_set():
                        break
                arrived.put((case, self.store.put(case, result)))
        except Exception as error:
            arrived.put(error)
        finally:
            if worker is not None:
                self._drop(worker)

    def _drop(self, worker: Worker) -> None:
        self._workers.discard(worker)
        worker.close()


def _ask(worker: Worker, case: Case, out: Path) -> Result:
    request = {"do": "run", "case": dataclasses.asdict(case), "out": str(out)}
    try:
        found = Result.from_dict(_checked(worker.ask(request, case.time_limit)))
        waited = worker.waited - sum(found.spent.values())  # a new process starts, and messages go to and fro
        return dataclasses.replace(found, spent=found.spent | {"process start": waited})
    except Missing as error:
        return Result(Status.MISSING, str(error))


def _lost(case: Case, error: WorkerDied) -> Result:
    return Result(error.status, str(error), versions={case.engine.name: case.engine.version})


def run_one(case: Case, out: Path) -> Result:
    """Runs a single case, its trajectory going to ``out``, with nothing stored or reused."""
    with Worker() as worker:
        try:
            return _ask(worker, case, out)
        except WorkerDied as error:
            return _lost(case, error)
