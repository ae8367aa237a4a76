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
from pathlib import Path
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
    if sys.platform != "linux" or threading.active_count() > 1 or "numpy" in sys.modules:
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
    if len(list(Path("/proc/self/task").iterdir())) > 1:
        return
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)  # which keeps messages apart
    sys.stdout.flush()
    sys.stderr.flush()
    if os.fork() == 0:
        _serve_forks(theirs)
    theirs.close()
    _line = ours


class Forked:
    """Forked worker, with the part of :class:`subprocess.Popen` that its parent uses.

    Args:
        answers: descriptor of the pipe for its answers.
        log: descriptor for what it prints.
        life: descriptor of the pipe that this process holds open while it lives.
        environment: its variables.

    Attributes:
        end: descriptor that can be read once the process has ended, to be closed by its parent.

    Raises:
        OSError: there is no template, or it does not answer.
    """

    def __init__(self, answers: int, log: int, life: int, environment: Mapping[str, str]) -> None:
        self.returncode: int | None = None
        requests, writer = os.pipe()
        try:
            self.pid = _told({"environment": environment}, requests, answers, log, life)
            self.end = os.pidfd_open(self.pid)
        except OSError:
            os.close(writer)
            raise
        finally:
            os.close(requests)
        self.stdin = os.fdopen(writer, "w", encoding="utf-8")

    def has_ended(self) -> bool:
        """True if the process has ended; nothing has waited for it, so that no other process has its number."""
        return bool(select.select([self.end], [], [], 0)[0])

    def wait(self) -> int:
        """Exit code of the process, for whose end it waits."""
        if self.returncode is None:
            select.select([self.end], [], [])
            try:
                self.returncode = _told({"ended": self.pid})
            except OSError:  # a template that was killed, and its workers with it
                self.returncode = -signal.SIGKILL
        return self.returncode


def forked(answers: int, log: int, life: int, environment: Mapping[str, str]) -> Forked | None:
    """Forked worker, see :class:`Forked`; None if there is no template, or it does not answer."""
    try:
        return Forked(answers, log, life, environment)
    except OSError:
        return None


def _told(message: Mapping[str, Any], *descriptors: int) -> int:
    """Number that the template answers. Raises OSError if there is none, or if it does not answer."""
    if _line is None:
        raise BrokenPipeError
    answer, theirs = os.pipe()  # of this message alone, so that threads need not wait for one another
    with os.fdopen(answer) as read:
        try:
            socket.send_fds(_line, [json.dumps(message).encode()], [theirs, *descriptors])
        finally:
            os.close(theirs)
        text = read.read()
    if not text:
        raise BrokenPipeError
    return int(text)


def _serve_forks(line: socket.socket) -> NoReturn:
    """Turns a process that was just forked into a template, and ends it with the process that it was forked from."""
    try:
        os.setsid()
        for number in INTERRUPTS:
            signal.signal(number, signal.SIG_DFL)
        nothing, template = os.open(os.devnull, os.O_RDWR), os.getpid()
        for standard in range(3):
            os.dup2(nothing, standard)
        _close_all_but(line.fileno())
        if not sys.flags.safe_path:
            del sys.path[0]  # the folder of the command, or the working folder
        atexit._clear()
        gc.freeze()  # a collection would copy the pages that all processes share
        while True:
            text, (answer, *descriptors), *_ = socket.recv_fds(line, _LONGEST, 5)
            message = json.loads(text)
            if "ended" in message:
                code = os.waitstatus_to_exitcode(os.waitpid(message["ended"], 0)[1])
            elif not (code := os.fork()):
                os.environ.clear()
                os.environ.update(message["environment"])
                _serve(template, *descriptors)
            os.write(answer, b"%d" % code)
            for descriptor in (answer, *descriptors):
                os.close(descriptor)
    finally:
        os._exit(0)


def _close_all_but(*kept: int) -> None:
    """Closes all descriptors of this process but these and the standard ones."""
    for descriptor, following in pairwise([2, *sorted(kept), os.sysconf("SC_OPEN_MAX")]):
        os.closerange(descriptor + 1, following)


def _serve(parent: int, requests: int, answers: int, log: int, life: int) -> NoReturn:
    """Turns a process that was just forked into a worker, as if it had been started, and ends it after its work."""
    code = 1
    try:
        os.setsid()
        for descriptor, own in zip((requests, log, log), range(3), strict=True):
            os.dup2(descriptor, own)
        _close_all_but(answers, life)
        PACE.aloud = True
        from proofroll.running.worker import main

        main(answers, parent, life)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        os._exit(code)
