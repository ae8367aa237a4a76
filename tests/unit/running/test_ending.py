"""Processes that end with the one that started them, however that one ends."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest

from proofroll.running.memory import descendants
from proofroll_drill.processes import alive, wait_until

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="the system has no /proc")

POOL = """
import sys, time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from proofroll.running.ending import end_with_pool

if __name__ == "__main__":
    with ProcessPoolExecutor(2, get_context("spawn"), initializer=end_with_pool) as pool:
        pool.submit(abs, 1).result()
        Path(sys.argv[1]).touch()
        pool.submit(time.sleep, 600).result()
"""
CHILD = """
import os, subprocess, sys, time
from pathlib import Path
from proofroll.running.ending import end_with

end_with(os.getppid())
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
Path(sys.argv[1]).touch()
time.sleep(600)
"""
PIPED = """
import ctypes, os, subprocess, sys
from pathlib import Path
from proofroll.running.ending import end_with_pipe

end_with_pipe(int(sys.argv[2]))
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
Path(sys.argv[1]).touch()
ctypes.PyDLL(None).sleep(600)
"""
HOLDER = """
import os, subprocess, sys
life, held = os.pipe()
subprocess.run([sys.executable, *sys.argv[1:], str(life)], pass_fds=[life], start_new_session=True)
"""
PARENT = "import subprocess, sys; subprocess.run([sys.executable, *sys.argv[1:]])"


@pytest.mark.parametrize(
    ("code", "before"),
    [(POOL, []), (CHILD, ["-c", PARENT]), (PIPED, ["-c", HOLDER])],
    ids=["a pool", "a process with a child of its own", "a process in which no thread can run, and its child"],
)
def test_nothing_outlives_a_parent_that_is_killed(tmp_path: Path, code: str, before: list[str]) -> None:
    """When the parent is killed its processes, and what they started, end, and before that they do not."""
    script, begun = tmp_path / "script.py", tmp_path / "begun"
    script.write_text(code)
    parent = subprocess.Popen([sys.executable, *before, str(script), str(begun)], stderr=subprocess.DEVNULL)
    try:
        assert wait_until(begun.exists, 60)
        time.sleep(0.6)
        below = descendants(parent.pid)
        assert len(below) >= 2
        assert all(map(alive, below))
    finally:
        parent.kill()
        parent.wait()
    assert wait_until(lambda: not any(map(alive, below)), 20)
