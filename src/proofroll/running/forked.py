"""Worker processes forked from one that has imported what they share: two thirds of a start.

A *template* is forked from a command while that has one thread, and forks each worker of it from then on. It runs
nothing else, so that no thread holds a lock while it forks, whatever the command and the workers do meanwhile.
"""

import atexit
import gc
import importlib
import json
import os
import select
import signal
import socket
import sys
import threading
import traceback
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Any, NoReturn

from proofroll.core.pace import PACE
from proofroll.running.process_end import INTERRUPTS

# One thread per worker, set before anything is imported there: workers run side by side.
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)
# Longest message to a template [bytes], most of it the variables of a worker.
_LONGEST = 1 << 20

_line: socket.socket | None = None


@cache
def may_be_forked() -> bool:
    """True if workers may be forked from this process: libraries that it imports from now on start no threads.

    False on other systems than Linux, beside other threads, and where numpy was imported before.
    """
    if not hasattr(os, "pidfd_open") or threading.active_count() > 1 or "numpy" in sys.modules:
        return False
    os.environ.update(THREADS)
    return True


def begin_template(*modules: str) -> None:
    """Makes the later workers of this process forks with the modules that it has, and these ``modules``.

    Without effect unless :func:`may_be_forked` held before numpy was imported, and no library has started a thread.
    """
    global _line  # noqa: PLW0603 -- a fact about the process, set once when it starts
    if _line is not None or not may_be_forked():
        return
    for name in modules:
        importlib.import_module(name)
    if len([*os.scandir("/proc/self/task")]) > 1:
        return
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)  # which keeps messages apart
    sys.stdout.flush()
    sys.stderr.flush()
    if os.fork() == 0:
        _serve(theirs)
    theirs.close()
    _line = ours


class Forked:
    """Forked worker, with the part of :class:`subprocess.Popen` that its parent uses.

    Attributes:
        pid: its number.
        end: descriptor that can be read once the process has ended, to be closed by its parent.
        returncode: exit code; None: nothing has waited for its end, so that no other process has its number.
    """

    def __init__(self, pid: int) -> None:
        self.pid, self.end = pid, os.pidfd_open(pid)
        self.returncode: int | None = None

    def has_ended(self) -> bool:
        """True if the process has ended."""
        return bool(select.select([self.end], [], [], 0)[0])

    def wait(self) -> int:
        """Exit code of the process, for whose end it waits."""
        if self.returncode is None:
            select.select([self.end], [], [])
            try:
                self.returncode = _told({"ended": self.pid})
            except (OSError, ValueError):  # the template was killed, and its workers with it
                self.returncode = -signal.SIGKILL
        return self.returncode


def forked(environment: Mapping[str, str], *descriptors: int) -> Forked | None:
    """Forked worker, or None if there is no template, or it does not answer.

    Args:
        environment: its variables.
        descriptors: of the pipes for its requests, its answers, what it prints, and the life of this process.
    """
    try:
        return Forked(_told({"environment": environment}, *descriptors))
    except (OSError, ValueError):
        return None


def _told(message: Mapping[str, Any], *descriptors: int) -> int:
    """Number that the template answers. Raises OSError if there is none, ValueError if it does not answer."""
    if _line is None:
        raise BrokenPipeError
    answer, theirs = os.pipe()  # of this message alone, so that threads need not wait for one another
    with os.fdopen(answer) as read:
        try:
            socket.send_fds(_line, [json.dumps(message).encode()], [theirs, *descriptors])
        finally:
            os.close(theirs)
        return int(read.read())


def _serve(line: socket.socket) -> NoReturn:
    """Turns a process that was just forked into a template, and each that it forks into a worker, as if started."""
    code = 1
    try:
        nothing, template = os.open(os.devnull, os.O_RDWR), os.getpid()
        _settle((nothing, nothing, nothing), line.fileno())
        for number in INTERRUPTS:
            signal.signal(number, signal.SIG_DFL)
        if not sys.flags.safe_path:
            del sys.path[0]  # the folder of the command, or the working folder
        atexit._clear()
        gc.freeze()  # a collection would copy the pages that all processes share
        environment, (requests, answers, log, life) = _asked_of_template(line)
        _settle((requests, log, log), answers, life)
        os.environ.clear()
        os.environ.update(environment)
        PACE.aloud = True
        from proofroll.running.worker import main

        main(answers, template, life)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        os._exit(code)


def _settle(standard: tuple[int, int, int], *kept: int) -> None:
    """Leaves to this process a session of its own, these standard descriptors, and those that are kept."""
    os.setsid()
    for descriptor, own in zip(standard, range(3), strict=True):
        os.dup2(descriptor, own)
    for number, following in pairwise([2, *sorted(kept), os.sysconf("SC_OPEN_MAX")]):
        os.closerange(number + 1, following)


def _asked_of_template(line: socket.socket) -> tuple[dict[str, str], list[int]]:
    """Environment and descriptors of a worker, in the process that was forked for it.

    The template answers messages until the process that sends them has ended, and then raises ValueError.
    """
    while True:
        text, (answer, *descriptors), *_ = socket.recv_fds(line, _LONGEST, 5)
        message = json.loads(text)
        if "ended" in message:
            told = os.waitstatus_to_exitcode(os.waitpid(message["ended"], 0)[1])
        elif not (told := os.fork()):
            return message["environment"], descriptors
        os.write(answer, b"%d" % told)
        for descriptor in (answer, *descriptors):
            os.close(descriptor)
