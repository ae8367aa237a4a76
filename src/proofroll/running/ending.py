"""A process that ends with the one that started it, however that one ends, and only then by Ctrl-C."""

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
# How often a process looks for its parent [s]; a look costs some microseconds.
_TICK = 0.25


@contextlib.contextmanager
def interrupt_held() -> Iterator[None]:
    """Ctrl-C waits until this is left, and processes that begin here never see it: who began them ends them.

    The mask is for what begins here. It does not keep another thread from taking the signal, for which Python then
    interrupts the main thread; so that waits, too, as do other signals that are handled. A second one ends at once.
    """
    waiting: list[int] = []

    def wait(number: int, _: object) -> None:
        if waiting:
            end_at_once()
        waiting.append(number)

    main = threading.current_thread() is threading.main_thread()
    handled = [number for number in INTERRUPTS if main and callable(signal.getsignal(number))]
    before = {number: signal.signal(number, wait) for number in handled}
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        for number, handler in before.items():
            signal.signal(number, handler)
    for held in waiting:
        signal.raise_signal(held)


def end_at_once(*_: object) -> None:
    """Handler of a second interrupt: ends this process with a line; what it started ends with it."""
    os.write(2, b"proofroll: interrupted again, ended at once; cases that were finished and stored will be reused\n")
    os._exit(130)


def end_with(parent: int) -> None:
    """Makes this process end, with all that it started, soon after ``parent`` has, even while it computes."""
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def end_with_pipe(pipe: int) -> None:
    """Makes the system end this process and its group when no process can write into a pipe any more.

    This also holds while an engine that computes in C lets no thread of Python run; only Linux can do it. ``pipe`` is
    its end for reading; nothing is ever written into the other.
    """
    if hasattr(fcntl, "F_SETSIG"):
        with contextlib.suppress(OSError):
            leads = os.getpgrp() == os.getpid()
            fcntl.fcntl(pipe, fcntl.F_SETOWN, -os.getpid() if leads else os.getpid())
            fcntl.fcntl(pipe, fcntl.F_SETSIG, signal.SIGKILL)
            fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_TICK)
    for process in descendants(os.getpid()):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(process, signal.SIGKILL)
    os._exit(1)
