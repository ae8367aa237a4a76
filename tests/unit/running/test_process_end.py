"""Processes that end with the one that started them, however that one ends."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from proofroll.running.memory import descendants
from proofroll.running.process_end import interrupt_held
from proofroll_drill.processes import alive, wait_until

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="the system has no /proc")

POOL = """
import sys, time
from pathlib import Path
from proofroll.running.process_end import process_pool

if __name__ == "__main__":
    with process_pool(2) as pool:
        pool.submit(abs, 1).result()
        Path(sys.argv[1]).touch()
        pool.submit(time.sleep, 600).result()
"""
CHILD = """
import os, subprocess, sys, time
from pathlib import Path
from proofroll.running.process_end import end_with

end_with(os.getppid())
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
Path(sys.argv[1]).touch()
time.sleep(600)
"""
PIPED = """
import ctypes, os, subprocess, sys
from pathlib import Path
from proofroll.running.process_end import end_with_pipe

end_with_pipe(int(sys.argv[2]))
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
Path(sys.argv[1]).touch()
ctypes.PyDLL(None).sleep(600)
"""
PROGRAM = """
import sys
from pathlib import Path
from proofroll.running.bound_program import BoundProgram

begin = "import subprocess, sys, time; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])"
program = BoundProgram([sys.executable, "-c", begin + "; print(1, flush=True); time.sleep(600)"])
program.stdout.readline()
Path(sys.argv[1]).touch()
program.wait()
"""
FORKED = """
import sys
from pathlib import Path
from proofroll.running.forked import begin_template, may_be_forked

assert may_be_forked()
begin_template()
from proofroll.running.process import Worker

begun = Path(sys.argv[1])
engine = begun.with_name("engine.py")
engine.write_text('''
import ctypes, subprocess, sys
from pathlib import Path

subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
Path(__file__).with_name("begun").touch()
ctypes.PyDLL(None).sleep(600)
''')
Worker().ask({"do": "call", "function": "runpy:run_path", "arguments": {"path_name": str(engine)}}, 600)
"""
HOLDER = """
import os, subprocess, sys
life, held = os.pipe()
subprocess.run([sys.executable, *sys.argv[1:], str(life)], pass_fds=[life], start_new_session=True)
"""
ENDED_AT_ONCE = "proofroll: interrupted again, ended at once\n"
PARENT = "import subprocess, sys; subprocess.run([sys.executable, *sys.argv[1:]])"


def test_a_time_limit_waits_until_processes_have_begun() -> None:
    """So does a signal from outside; a second one ends the command at once, with one line."""
    program = (
        "import signal, sys\nfrom proofroll.running.process_end import interrupt_held\n"
        "signal.signal(signal.SIGTERM, lambda *_: sys.exit('handled'))\n"
        "with interrupt_held():\n for _ in range(int(sys.argv[1])): signal.raise_signal(signal.SIGTERM)\n"
        " print('begun', flush=True)\n"
    )
    for times, expected in ((1, (1, "begun\n", "handled\n")), (2, (130, "", ENDED_AT_ONCE))):
        ended = subprocess.run([sys.executable, "-c", program, str(times)], capture_output=True, text=True, check=False)
        assert (ended.returncode, ended.stdout, ended.stderr) == expected


def test_an_interrupt_during_an_error_is_not_lost() -> None:
    """Ctrl-C while processes are started, whose start then fails, interrupts as any other."""

    def begin() -> None:
        with interrupt_held():
            signal.getsignal(signal.SIGINT)(signal.SIGINT, None)  # type: ignore[operator, misc, arg-type]
            raise OSError("no process")

    with pytest.raises(KeyboardInterrupt):
        begin()


def test_an_interrupt_waits_until_processes_have_begun() -> None:
    """Ctrl-C that another thread takes does not break the start of a process in two; it comes right after."""
    begins, began = threading.Event(), []

    def take() -> None:
        begins.wait()
        signal.raise_signal(signal.SIGINT)

    taker = threading.Thread(target=take)
    taker.start()  # before anything is held, as a thread that shows progress

    def begin() -> None:
        with interrupt_held():
            begins.set()
            taker.join()
            began.append(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))

    with pytest.raises(KeyboardInterrupt):
        begin()
    assert began == [True]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.parametrize(
    ("code", "before"),
    [(POOL, []), (PROGRAM, []), (FORKED, []), (CHILD, ["-c", PARENT]), (PIPED, ["-c", HOLDER])],
    ids=[
        "a pool",
        "a program",
        "a forked worker in which no thread can run, and its child",
        "a process with a child of its own",
        "a process in which no thread can run, and its child",
    ],
)
def test_nothing_outlives_a_parent_that_is_killed(tmp_path: Path, code: str, before: list[str]) -> None:
    """When the parent is killed its processes, and what they started, end, and before that they do not."""
    script, begun = tmp_path / "script.py", tmp_path / "begun"
    script.write_text(code)
    parent = subprocess.Popen([sys.executable, *before, str(script), str(begun)], stderr=subprocess.DEVNULL)
    try:
        assert wait_until(begun.exists, 300)
        time.sleep(0.6)
        below = descendants(parent.pid)
        assert len(below) >= 2
        assert all(map(alive, below))
    finally:
        parent.kill()
        parent.wait()
    assert wait_until(lambda: not any(map(alive, below)), 300)
