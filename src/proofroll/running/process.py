"""Parent's side of a worker process: sends requests, watches it, and ends it with all that it started."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from proofroll.core.errors import InputError, Missing, ProofrollError, Unwritable
from proofroll.core.pace import AT, PACE
from proofroll.running.case import Status
from proofroll.running.forked import THREADS, Forked, forked
from proofroll.running.memory import VARIABLE, descendants, memory_limit, resident_gb

# A worker draws nothing; MuJoCo would look for a library of windows, which takes a tenth of a second.
_NO_WINDOWS = {"MUJOCO_GL": "disable"}
# Variables that redirect a Python's imports or start-up; they are meant for this Python, not for another interpreter.
_OF_THIS_PYTHON = (
    "PYTHONPATH", "PYTHONHOME", "PYTHONEXECUTABLE", "PYTHONPLATLIBDIR", "PYTHONSTARTUP", "PYTHONUSERBASE",
    "__PYVENV_LAUNCHER__",
)  # fmt: skip
# Interval at which a worker's memory and life are checked [s]: a check costs less than 0.1 ms; memory fills at GB/s.
_TICK = 0.1
# Time that a process may take to end after it closed its answers, for threads and exit handlers [s].
_GRACE = 5.0
# Length of the end of an engine's output that is kept [bytes]; it comes through a pipe, so that it cannot fill a disk.
_KEPT = 4096
# Most reads to empty the pipe of 64 kB, as a read may return only a line.
_DRAUGHTS = 64
# Longest answer [bytes]; a record has a few kB.
_LONGEST_ANSWER = 1 << 22

_living: set[Worker] = set()
_counting = threading.Lock()
_used_by_workers = 0.0


class WorkerDied(ProofrollError):  # noqa: N818 -- a fact about the worker, turned into a row of the report
    """The worker process ended without an answer."""

    def __init__(self, status: Status, message: str) -> None:
        self.status = status
        super().__init__(message)


def status_of(error: ProofrollError) -> Status:
    """Status of a case whose engine gave this error in place of a result."""
    if isinstance(error, WorkerDied):
        return error.status
    statuses = {InputError: Status.REFUSED, Missing: Status.MISSING}
    return next((status for kind, status in statuses.items() if isinstance(error, kind)), Status.CRASHED)


def end_all() -> None:
    """Kills every worker of this process with all that it started, without waiting; safe in a signal handler."""
    for worker in list(_living):
        worker.shoot()


def truths_at() -> list[str]:
    """Lines about how far truths have come, in this process and its workers."""
    lines = [item for worker in list(_living) for item in worker.said[-1:]]
    return [*([f"{AT}{PACE.text}"] if PACE.text else []), *(item for item in lines if item.startswith(AT))]


def processor_seconds() -> float:
    """Processor time of this process and of its workers, up to their last answers, or to their end [s]."""
    return time.process_time() + _used_by_workers


def _count(worker: Worker, used: float) -> None:
    global _used_by_workers  # noqa: PLW0603 -- a total of this process
    with _counting:
        _used_by_workers += max(0.0, used - worker.used)
        worker.used = max(used, worker.used)


def safe_environment() -> dict[str, str]:
    """Environment variables for a child Python that must not import from the working folder (``-m``, ``-c``)."""
    return {**os.environ, "PYTHONSAFEPATH": "1"}


def environment_of_another() -> dict[str, str]:
    """Environment variables for a process in another interpreter, without those that redirect its imports."""
    return {name: value for name, value in safe_environment().items() if name not in _OF_THIS_PYTHON}


class Worker:
    """A worker process, forked if there is a :func:`.forked.begin_template`. After its end a new one must be made.

    Args:
        memory: limit for it and its descendants [GB]; by default :func:`memory.memory_limit`.
        python: another interpreter in which it runs; by default this one.

    Attributes:
        waited: wall time for the last answer; for the first one from the start of the process [s].
        used: processor time of the process until its last answer [s].
    """

    def __init__(self, memory: float | None = None, python: Path | None = None) -> None:
        self._began, self.waited = time.perf_counter(), 0.0
        self._memory = memory or memory_limit()
        self._ending = threading.Lock()
        self._answers, writer = os.pipe()
        self._words, log = os.pipe()
        requests, asked = os.pipe()
        self._requests = os.fdopen(asked, "w", encoding="utf-8")
        life, self._life = os.pipe()  # never written to: it closes when this process ends, even if killed
        os.set_blocking(self._words, False)
        self._open = [self._answers, self._words]
        self._descriptors = [*self._open, self._life]
        environment = _NO_WINDOWS | (environment_of_another() if python else safe_environment()) | THREADS
        self._process: subprocess.Popen[bytes] | Forked
        try:
            self._process = (None if python else forked(environment, requests, writer, log, life)) or subprocess.Popen(
                [python or sys.executable, "-m", "proofroll.running.worker", str(writer), str(os.getpid()), str(life)],
                stdin=requests,
                stdout=log,
                stderr=log,
                pass_fds=(writer, life),
                env=environment,
                start_new_session=True,  # Ctrl-C reaches the parent alone, which then ends its workers
            )
        except OSError as error:
            self._close_pipes()
            raise ProofrollError(f"a worker process cannot be started: {error.strerror or error}") from None
        finally:
            for descriptor in (requests, writer, log, life):
                os.close(descriptor)
        if isinstance(self._process, Forked):
            self._descriptors.append(self._process.end)
        _living.add(self)
        self.used, self._asked = 0.0, 0
        self._pending = self._said = b""

    def ask(self, request: Mapping[str, Any], time_limit: float) -> dict[str, Any]:
        """Answer to one request.

        Args:
            request: for the worker.
            time_limit: wall time, without time in which others had the processor [s].

        Raises:
            WorkerDied: the process crashed, took too long, or needed too much memory.
        """
        self._forget_words()
        self._asked += 1
        try:
            self._requests.write(json.dumps({**request, "number": self._asked}) + "\n")
            self._requests.flush()
        except (OSError, ValueError):  # the pipe is broken or closed
            raise WorkerDied(Status.CRASHED, self._last_words()) from None
        asked = time.perf_counter()
        line = self._line(time_limit)
        self.waited = time.perf_counter() - (self._began or asked)
        self._began = 0.0
        with contextlib.suppress(ValueError):
            answer = json.loads(line)
            if isinstance(answer, dict) and answer.pop("number", None) == self._asked:
                _count(self, answer.pop("used", 0.0))
                return answer
        self.kill()
        raise WorkerDied(Status.CRASHED, "the engine wrote into the answers of its process, which was ended")

    def request(self, request: Mapping[str, Any], time_limit: float) -> dict[str, Any]:
        """Answer to one request as by :meth:`ask`, with the worker's errors raised.

        Raises:
            InputError, Missing, Unwritable, WorkerDied: the worker answers so, or it ended.
        """
        answer = self.ask(request, time_limit)
        match answer.get("error"):
            case "input":
                raise InputError(answer["field"], answer["value"], answer["advice"])
            case "missing":
                raise Missing(answer["message"])
            case "unwritable":
                raise Unwritable(answer["message"], answer["errno"], answer["reason"])
            case "crashed":
                raise WorkerDied(Status.CRASHED, answer["message"])
        return answer

    def _line(self, time_limit: float) -> bytes:
        """Next line of the answers; raises WorkerDied if there is none in time."""
        starved_before = _starved(self._process.pid)
        deadline = time.monotonic() + time_limit
        look = time.monotonic() + _TICK
        while b"\n" not in self._pending:
            now = time.monotonic()
            if now >= deadline:
                # Extend the deadline by the time in which other processes had the processor.
                starved_now = _starved(self._process.pid)
                if starved_now - starved_before > _TICK:
                    deadline, starved_before = now + starved_now - starved_before, starved_now
                    continue
                self.kill()
                raise WorkerDied(Status.TIMEOUT, f"no result within {time_limit:g} s; it was ended")
            if now >= look:
                look = now + _TICK
                self._watch_memory()
            if self._answers in self._listen(min(deadline - now, _TICK)):
                chunk = os.read(self._answers, 65536)
                if not chunk:
                    raise WorkerDied(Status.CRASHED, self._last_words())
                self._pending += chunk
                if len(self._pending) > _LONGEST_ANSWER:
                    break
            elif self._ended() and self._answers not in self._listen(0):  # a child of it may keep the pipe open
                raise WorkerDied(Status.CRASHED, self._last_words())
        line, _, self._pending = self._pending.partition(b"\n")
        return line

    def _watch_memory(self) -> None:
        if resident_gb(self._process.pid) > self._memory:
            self.kill()
            fault = f"needed more than {self._memory:g} GB of memory and was ended; {VARIABLE} allows more"
            raise WorkerDied(Status.CRASHED, fault)

    def _listen(self, seconds: float) -> list[int]:
        """Waits for answers or printed text, keeps the end of the text, and returns the pipes that were ready."""
        ready = select.select(self._open, [], [], seconds)[0]
        if self._words in ready:
            with contextlib.suppress(BlockingIOError):
                heard = os.read(self._words, 65536)
                self._said = (self._said + heard)[-_KEPT:]
                if not heard:
                    self._open.remove(self._words)
        return ready

    def _forget_words(self) -> None:
        """Drops text printed during an earlier request, which would not explain a crash in this one."""
        if self._asked and not self._ended():
            for _ in range(_DRAUGHTS):
                if self._words not in self._listen(0):
                    break
            self._said = b""

    def _ended(self) -> bool:
        """True if the process has ended. It is not reaped, so that no other process can get its number."""
        if self._process.returncode is not None:
            return True
        if isinstance(self._process, Forked):
            return self._process.has_ended()
        if not hasattr(os, "waitid"):  # macOS before Python 3.13: there what the process started outlives it
            return self._process.poll() is not None
        try:
            return os.waitid(os.P_PID, self._process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
        except ChildProcessError:
            return True

    def _last_words(self) -> str:
        """Sentence with the way in which the process ended and the last line that it printed."""
        self._open = [item for item in self._open if item == self._words]
        deadline = time.monotonic() + _GRACE
        while not (ended := self._ended()) and time.monotonic() < deadline:
            self._listen(_TICK / 10)
        code = self.kill()
        for _ in range(_DRAUGHTS):
            if not self._listen(0):
                break
        how = _how(code) if ended else "closed its answers without ending"
        last = "".join(self.said[-1:])
        return f"the engine's process {how}" + (f": {last[:200]}" if last else "")

    @property
    def said(self) -> list[str]:
        """Last lines that it printed."""
        lines = self._said.decode(errors="replace").splitlines()
        return [" ".join(line.split()) for line in lines if line.strip()]

    def shoot(self) -> None:
        """Kills the process and all that it started, without waiting."""
        if self._process.returncode is not None:
            return  # its number may belong to another process by now
        for process in descendants(self._process.pid):  # those that left the process group, with theirs
            with contextlib.suppress(ProcessLookupError, PermissionError):
                if (group := os.getpgid(process)) not in {self._process.pid, os.getpgrp()}:
                    os.killpg(group, signal.SIGKILL)
                os.kill(process, signal.SIGKILL)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)

    def kill(self) -> int:
        """Kills the process with all that it started, and returns its exit code."""
        with self._ending:
            if self._process.returncode is None:
                _count(self, _spent(self._process.pid))
            self.shoot()
            _living.discard(self)
            return self._process.wait()

    def close(self) -> None:
        """Kills the process and closes its pipes."""
        self.kill()
        self._close_pipes()

    def _close_pipes(self) -> None:
        with contextlib.suppress(BrokenPipeError):
            self._requests.close()
        while self._descriptors:
            os.close(self._descriptors.pop())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _starved(process: int) -> float:
    """Longest time [s] that a thread of the process or of its descendants was ready while others had the processor.

    On a busy machine wall time says little about an engine. The kernel counts how long every thread waited for a
    processor (``schedstat``, second number). A process that hangs asleep does not wait for one, so that a limit of wall
    time less this one still ends it. 0 where the system does not count.
    """
    longest = 0
    for member in (process, *descendants(process)):
        with contextlib.suppress(OSError, ValueError, IndexError):  # it has just ended, or there is no such file
            for task in Path(f"/proc/{member}/task").iterdir():
                longest = max(longest, int((task / "schedstat").read_text(encoding="ascii").split()[1]))
    return longest * 1e-9


def _spent(process: int) -> float:
    """Processor time of a process, its descendants and those of them that have ended [s]; 0 without ``/proc``."""
    ticks = 0
    for member in (process, *descendants(process)):
        with contextlib.suppress(OSError, ValueError):  # it has just ended, or there is no such file
            numbers = Path(f"/proc/{member}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
            ticks += sum(map(int, numbers[11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def _how(code: int) -> str:
    """Exit code in words."""
    if code >= 0:
        return f"ended with exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    return f"was killed by {name}" + (", as by a system that runs out of memory" if -code == signal.SIGKILL else "")
