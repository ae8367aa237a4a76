"""What can happen to the command itself: a full disk, Ctrl-C, a second run into the same folder. Real processes."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proofroll.drill.row import Drilled, drilled
from proofroll.drill.site import BEFORE, BESIDE, Site, contents, scraps
from proofroll.running.case import Case
from proofroll.running.runner import Runner
from proofroll.running.store import Store

# No command of the drill takes this long on any machine [s].
_LIMIT = 120.0
# A file on the full disk may have this many bytes: no result is so small.
_ROOM = 1024
# A shell's job may have been told to ignore Ctrl-C; and whoever may write everywhere still meets this limit.
_START = """
import resource, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
if room := int(sys.argv.pop(1)):
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
from proofroll.__main__ import main
main()
"""


@dataclass(frozen=True)
class Ended:
    """How a command ended, and what it wrote."""

    code: int
    out: str
    err: str

    @property
    def runs(self) -> list[dict[str, Any]]:
        """The runs of a comparison."""
        found: list[dict[str, Any]] = json.loads(self.out)["runs"]
        return found


def _start(arguments: Sequence[str | Path], room: int = 0) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", _START, str(room), *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def _end(process: subprocess.Popen[str]) -> Ended:
    try:
        out, err = process.communicate(timeout=_LIMIT)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
    return Ended(process.returncode, out, err)


def _compare(claim: Path, out: Path, *more: str) -> list[str | Path]:
    return ["compare", claim, "--out", out, "--json", *more]


def prepare(site: Site) -> Path:
    """A folder of the comparison's results that are there before anything goes wrong."""
    folder = site.folder / "compared"
    _end(_start(_compare(site.claim("before", BEFORE[:1]), folder)))
    return folder


def drill_full_disk(site: Site, sound: Path) -> Drilled:
    """A disk without room: a limit on the size of every file, which stops root too."""
    out = site.folder / "full_disk"
    shutil.copytree(sound, out)
    before = contents(out / "cases")
    claim = site.claim("full_disk", [BEFORE[0], BESIDE[0]])
    full = _end(_start(_compare(claim, out), _ROOM))
    after, left = contents(out / "cases"), scraps(out / "cases")
    mended = _end(_start(_compare(claim, out)))
    runs = {run["parameters"]["speed"]: run for run in full.runs}
    message = runs[BESIDE[0]]["message"]
    return drilled(
        "full disk",
        message.replace(str(site.folder), "…"),
        expected="cannot be written (File too large)",
        others=[runs[BEFORE[0]]["status"] == "done"],
        before=before,
        after=after,
        again=contents(out / "cases"),
        missing=2,  # the truth at the other point, and the engine
        problems={
            f"the exit code was {full.code}": full.code != 3,
            f"afterwards the exit code was {mended.code}": mended.code != 0,
            f"{', '.join(left)} was left in the folder": bool(left),
        },
    )


def drill_interrupt(site: Site, sound: Path) -> Drilled:
    """Ctrl-C while one engine hangs and the others have finished: to the whole group, as a terminal sends it."""
    out = site.folder / "interrupt"
    shutil.copytree(sound, out)
    before = contents(out / "cases")
    claim = site.claim("interrupt", [BEFORE[0], BESIDE[0]], faulty="waits_for_ctrl_c")
    process = _start(_compare(claim, out, "--jobs", "2"))
    begun = site.folder / "alive-waits_for_ctrl_c"
    expected = len(before) + 2  # the truth at the other point, and the engine
    deadline = time.monotonic() + _LIMIT
    while not (begun.exists() and len(contents(out / "cases")) == expected):
        if process.poll() is not None or time.monotonic() > deadline:
            break
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    start = time.monotonic()
    ended = _end(process)
    took = time.monotonic() - start
    after, left, alive = contents(out / "cases"), scraps(out / "cases"), site.alive("waits_for_ctrl_c")
    site.cure("waits_for_ctrl_c")
    mended = _end(_start(_compare(claim, out)))
    return drilled(
        "interrupt (Ctrl-C)",
        ended.err.strip(),
        expected="interrupted",
        others=[index < len(after) for index in range(expected)],
        before=before,
        after=after,
        again=contents(out / "cases"),
        missing=1,
        problems={
            f"the exit code was {ended.code}": ended.code != 130,
            f"it took {took:.0f} s to end": took > _LIMIT / 4,
            f"afterwards the exit code was {mended.code}": mended.code != 0,
            f"{', '.join(left)} was left in the folder": bool(left),
            "a process of the engine lives on": alive,
        },
    )


def drill_two_runs(site: Site, sound: Path) -> Drilled:
    """Two commands that make the same results anew in one folder, at once."""
    out = site.folder / "two_runs"
    shutil.copytree(sound, out)
    claim = site.claim("two_runs", [BEFORE[0], *BESIDE])
    both = [_end(process) for process in [_start(_compare(claim, out, "--fresh")) for _ in range(2)]]
    after, left = contents(out / "cases"), scraps(out / "cases")
    records = [json.loads(path.read_text(encoding="utf-8")) for path in (out / "cases").glob("[!.]*.json")]
    Runner(Store(out / "cases")).run([Case.from_dict(record["case"]) for record in records])
    ends = [[(run["parameters"], run["verdict"]) for run in ended.runs] if ended.out else [] for ended in both]
    codes = " and ".join(str(ended.code) for ended in both)
    return drilled(
        "two runs in one folder",
        f"they ended with the exit codes {codes}, and {'the same' if ends[0] == ends[1] else 'other'} verdicts",
        expected="0 and 0, and the same verdicts",
        others=[run["status"] == "done" for ended in both if ended.out for run in ended.runs],
        before={},  # every result is made anew
        after=after,
        again=contents(out / "cases"),
        missing=0,
        problems={
            "something was said besides": any(ended.err for ended in both),
            f"{', '.join(left)} was left in the folder": bool(left),
        },
    )
