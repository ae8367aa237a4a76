"""Processes of their own in which commands and programs of the drill run, and how they end."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from proofroll.running.case import Case

# No process of the drill takes this long on any machine [s].
LIMIT = 120.0
# A shell's job may have been told to ignore Ctrl-C and the end of its terminal.
_COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from proofroll.__main__ import main
main()
"""
# Makes cases anew and says how each ended. The size of a file may be limited for this process alone, whose worker was
# there before and which a larger file ends, or for its workers too, where writing one fails.
_CASES = """
import json, resource, signal, sys
from pathlib import Path
from proofroll.core.errors import Unwritable
from proofroll.running.case import Case
from proofroll.running.process import Worker
from proofroll.running.runner import Runner
from proofroll.running.store import Store

folder, cases, room, alone = json.loads(sys.argv[1])
runner = Runner(Store(Path(folder)), jobs=1, fresh=True)
if alone:
    runner.workers.keep(cases[0]["engine"]["name"], Worker())
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
if room:
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
try:
    results = runner.run([Case.from_dict(case) for case in cases])
except Unwritable as error:
    print(json.dumps({"all": ["unwritable", str(error)]}))
    sys.exit()
print(json.dumps({key: [result.status, result.message] for key, result in results.items()}))
"""


@dataclass(frozen=True)
class Ended:
    """End of a process, and its output."""

    code: int
    out: str
    err: str

    @property
    def results(self) -> dict[str, tuple[str, str]]:
        """Status and message of the cases that were made, by key."""
        return {key: tuple(result) for key, result in json.loads(self.out or "{}").items()}

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


def command(*arguments: str | Path) -> subprocess.Popen[str]:
    """The command ``proofroll``."""
    return start("-c", _COMMAND, *arguments)


def run(store: Path, cases: Sequence[Case], room: int = 0, alone: bool = False) -> subprocess.Popen[str]:
    """Makes cases anew, one after another.

    Args:
        store: folder of the results.
        cases: cases to be run.
        room: largest size of a file [bytes]; 0: as one likes.
        alone: True if the limit holds for the process itself, not for its workers, and ends it.
    """
    asked = [str(store), [dataclasses.asdict(case) for case in cases], room, alone]
    return start("-c", _CASES, json.dumps(asked))


def end(process: subprocess.Popen[str]) -> Ended:
    """Waits for the end of a process."""
    try:
        out, err = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
    return Ended(process.returncode, out, err)


def wait_until(reached: Callable[[], bool], seconds: float = LIMIT) -> bool:
    """Waits until a condition holds; False if it does not in time."""
    deadline = time.monotonic() + seconds
    while not (found := reached()) and time.monotonic() < deadline:
        time.sleep(0.05)
    return found


def alive(process: int) -> bool:
    """True if a process runs; one that waits to be reaped does not."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] not in "ZX"
    return False
