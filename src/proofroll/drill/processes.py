"""Processes of their own in which commands and programs of the drill run, and how they end."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# No process of the drill takes this long on any machine [s].
LIMIT = 120.0
# A shell's job may have been told to ignore Ctrl-C and the end of its terminal; and whoever may write everywhere still
# meets the limit on the size of a file.
_COMMAND = """
import resource, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
if room := int(sys.argv.pop(1)):
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
from proofroll.__main__ import main
main()
"""


@dataclass(frozen=True)
class Ended:
    """How a process ended, and what it wrote."""

    code: int
    out: str
    err: str

    @property
    def runs(self) -> list[dict[str, Any]]:
        """The runs of a comparison."""
        found: list[dict[str, Any]] = json.loads(self.out)["runs"]
        return found

    @property
    def said(self) -> str:
        """A sentence about the end, and what was written about it."""
        how = f"was killed by {signal.Signals(-self.code).name}" if self.code < 0 else f"exit code {self.code}"
        return ": ".join(filter(None, [how, " ".join(self.err.split())]))


def start(*arguments: str | Path) -> subprocess.Popen[str]:
    """Python with these arguments, in a session of its own."""
    return subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def command(*arguments: str | Path, room: int = 0) -> subprocess.Popen[str]:
    """The command ``proofroll``, which may write no file of more than ``room`` bytes (0: as it likes)."""
    return start("-c", _COMMAND, str(room), *arguments)


def end(process: subprocess.Popen[str]) -> Ended:
    """Waits for the end of a process."""
    try:
        out, err = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
    return Ended(process.returncode, out, err)


def wait_until(reached: Callable[[], bool], seconds: float = LIMIT) -> bool:
    """Whether something is reached in time."""
    deadline = time.monotonic() + seconds
    while not (found := reached()) and time.monotonic() < deadline:
        time.sleep(0.05)
    return found


def alive(process: int) -> bool:
    """Whether a process runs; one that only waits to be reaped does not."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] not in "ZX"
    return False
