"""Programs that end with what started them; where processes are started at all."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import proofroll
from proofroll.running.bound_program import BoundProgram, printed_by

# The modules that start processes, each of which ends with the process that started it; see test_process_end.
_STARTERS = {f"running/{name}.py" for name in ("bound_program", "forked", "process", "process_end")}
_STARTS = re.compile(
    r"\bsubprocess\.(Popen|run|call|check_\w+|get\w+)\b"
    r"|\bos\.(fork\w*|popen|system|posix_spawn\w*|spawn\w+|exec\w+)\b|\b(ProcessPoolExecutor|\w*\.?Process|\.Pool)\("
)


@pytest.mark.drill
def test_every_process_is_started_by_four_modules() -> None:
    """No module but four starts a process: a call of subprocess, of os, or of a pool."""
    folder = Path(proofroll.__file__).parent
    files = {file.relative_to(folder).as_posix(): file.read_text(encoding="utf-8") for file in folder.rglob("*.py")}
    assert {name for name, text in files.items() if _STARTS.search(text)} == _STARTERS


def test_a_program_has_its_own_answer() -> None:
    """The exit code, the output and standard error are the program's; beyond the time limit it is ended."""
    code = "import os, sys; print(os.environ['A']); print('bad', file=sys.stderr); sys.exit(3)"
    assert printed_by([sys.executable, "-c", code], {"A": "good"}) == (3, "good\n", "bad\n")
    with pytest.raises(subprocess.TimeoutExpired):
        printed_by([sys.executable, "-c", "import time; time.sleep(600)"], {}, time_limit=0.2)


def test_what_cannot_be_executed_is_an_error(tmp_path: Path) -> None:
    """A file that is no program raises OSError and leaves nothing open."""
    (tmp_path / "text").write_text("text")
    before = len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").exists() else 0
    for name in ("text", "none"):
        with pytest.raises(OSError, match="cannot be executed"):
            BoundProgram([tmp_path / name])
    assert before == (len(os.listdir("/proc/self/fd")) if before else 0)


def test_the_end_leaves_nothing_open() -> None:
    """A program that was ended has left no descriptor and no process of its group."""
    before = len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").exists() else 0
    program = BoundProgram([sys.executable, "-c", "import time; time.sleep(600)"])
    program.end()
    assert program.returncode == -9
    assert before == (len(os.listdir("/proc/self/fd")) if before else 0)
    ended = time.monotonic() + 10
    while time.monotonic() < ended:
        try:
            os.killpg(program.pid, 0)
        except (ProcessLookupError, PermissionError):
            return
        time.sleep(0.01)
    pytest.fail("its group is alive")
