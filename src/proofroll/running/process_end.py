"""Ends processes when the one that started them ends, which alone handles Ctrl-C; a function in several processes."""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeVar

from proofroll.running.memory import descendants

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

Item = TypeVar("Item")
Found = TypeVar("Found")

# Signals by which a command is ended from outside: Ctrl-C, a time limit, the end of the terminal.
INTERRUPTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# Interval at which a process looks for its parent [s]; a look costs some microseconds.
_TICK = 0.25


@contextlib.contextmanager
def interrupt_held() -> Iterator[None]:
    """Context manager that defers Ctrl-C to its end; processes started inside never receive it.

    These processes inherit the signal mask; their parent ends them. The mask is not enough here, as another thread may
    receive the signal: so handlers record each handled signal, which is raised at the end, also after an error. A
    second signal ends the process at once.
    """
    waiting: list[int] = []

    def wait(number: int, _: object) -> None:
        if waiting:
            end_at_once()
        waiting.append(number)

    main = threading.current_thread() is threading.main_thread()
    handled = [number for number in INTERRUPTS if main and callable(signal.getsignal(number))]
    handlers = {number: signal.signal(number, wait) for number in handled}
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for late in waiting:  # also after an error, or it would be lost
            signal.raise_signal(late)


def end_at_once(*_: object) -> None:
    """Handler of a second interrupt: ends this process, and with it those that it started, after a line of text."""
    os.write(2, b"proofroll: interrupted again, ended at once\n")
    os._exit(130)


def end_with(parent: int) -> None:
    """Makes this process, with all that it started, end soon after ``parent`` has, even while it computes."""
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def end_with_pipe(pipe: int) -> None:
    """Makes the kernel kill this process and its group once no process can write into a pipe any more (Linux only).

    It works even while an engine that computes in C blocks all Python threads.

    Args:
        pipe: reading end of a pipe into which nothing is ever written.
    """
    if not hasattr(fcntl, "F_SETSIG"):
        return
    with contextlib.suppress(OSError):
        fcntl.fcntl(pipe, fcntl.F_SETOWN, -os.getpid() if os.getpgrp() == os.getpid() else os.getpid())
        fcntl.fcntl(pipe, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_TICK)
    for process in descendants(os.getpid()):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(process, signal.SIGKILL)
    os._exit(1)


def in_processes(function: Callable[[Item], Found], items: Sequence[Item], workers: int) -> Iterator[Found]:
    """Yields a function's result for each item, in order, computed in ``workers`` processes; 1: in this one.

    The function and its results must be picklable. Ctrl-C ends the processes.
    """
    from multiprocessing import active_children

    if workers == 1:
        yield from map(function, items)
        return
    with process_pool(workers) as pool:
        try:
            # Not pool.map: when interrupted it cancels the rest, and the pool complains when its processes are killed.
            with interrupt_held():
                futures = [pool.submit(function, item) for item in items]
            for future in futures:
                yield future.result()
        except BaseException:
            for process in active_children():
                process.kill()
            raise


def process_pool(workers: int) -> ProcessPoolExecutor:
    """Pool of processes that end with this process.

    They are spawned, not forked: a parent that shows progress has threads, and a fork would copy their held locks.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=_end_with_pool)


def _end_with_pool() -> None:
    """Makes a process of a pool end with its parent.

    Otherwise it would wait for ever, on a pipe that all of the pool's processes hold open, if the parent is killed.
    """
    from multiprocessing import parent_process

    owner = parent_process()
    if owner is not None and owner.pid is not None:
        end_with(owner.pid)
