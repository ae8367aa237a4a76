"""Worker processes forked from a command, with the modules that it has imported: two thirds of a start."""

import atexit
import gc
import os
import signal
import sys
import threading
import traceback
from collections.abc import Mapping
from itertools import pairwise
from typing import NoReturn

from proofroll.core.pace import PACE
from proofroll.running.process_end import INTERRUPTS

# One thread per worker, set before anything is imported there: workers run side by side.
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


def may_be_forked() -> bool:
    """True if workers may be forked from this process: libraries that it imports from now on start no threads.

    False on other systems than Linux, beside other threads, and where numpy was imported before.
    """
    if sys.platform != "linux" or threading.active_count() > 1 or "numpy" in sys.modules:
        return False
    os.environ.update(THREADS)
    return True


class Forked:
    """Forked worker, with the part of :class:`subprocess.Popen` that its parent uses.

    Args:
        answers: descriptor of the pipe for its answers.
        log: descriptor for what it prints.
        life: descriptor of the pipe that this process holds open while it lives.
        environment: its variables.
    """

    def __init__(self, answers: int, log: int, life: int, environment: Mapping[str, str]) -> None:
        self.returncode: int | None = None
        requests, writer = os.pipe()
        parent = os.getpid()
        sys.stdout.flush()
        sys.stderr.flush()
        self.pid = os.fork()
        if self.pid == 0:
            os.environ.update(environment)
            _serve((requests, log, log), answers, life, parent)
        os.close(requests)
        self.stdin = os.fdopen(writer, "w", encoding="utf-8")

    def poll(self) -> int | None:
        """Exit code of the process; None: nothing has waited for its end."""
        return self.returncode

    def wait(self) -> int:
        """Exit code of the process, for whose end it waits."""
        if self.returncode is None:
            self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self.returncode


def _serve(standard: tuple[int, int, int], answers: int, life: int, parent: int) -> NoReturn:
    """Turns a process that was just forked into a worker, as if it had been started, and ends it after its work."""
    code = 1
    try:
        os.setsid()
        for number in INTERRUPTS:
            signal.signal(number, signal.SIG_DFL)
        for descriptor, own in zip(standard, range(3), strict=True):
            os.dup2(descriptor, own)
        for kept, following in pairwise([2, *sorted((answers, life)), os.sysconf("SC_OPEN_MAX")]):
            os.closerange(kept + 1, following)
        if not sys.flags.safe_path:
            del sys.path[0]  # the folder of the command, or the working folder
        atexit._clear()
        gc.freeze()  # a collection would copy the pages that both processes share
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
