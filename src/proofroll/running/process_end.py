"""Ends a process when the process that started it ends, and lets only the latter handle Ctrl-C."""

import contextlib
import fcntl
import os
import signal
import threading
import time
from collections.abc import Iterator

from proofroll.running.memory import descendants

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
