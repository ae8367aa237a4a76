"""What can happen to the command itself: a full disk, Ctrl-C, a second run into the same folder. Real processes."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from pathlib import Path

from proofroll.case import Case
from proofroll.drill.processes import LIMIT, command, end, wait_until
from proofroll.drill.row import Drilled, drilled
from proofroll.drill.site import BEFORE, BESIDE, Site, contents, scraps

# A file on the full disk may have this many bytes: no result is so small.
_ROOM = 1024


def _compare(claim: Path, out: Path, *more: str) -> list[str | Path]:
    return ["compare", claim, "--out", out, "--json", *more]


def prepare(site: Site) -> Path:
    """A folder of the comparison's results that are there before anything goes wrong."""
    folder = site.folder / "compared"
    site.compare(site.claim("before", BEFORE[:1]), folder)
    return folder


def drill_full_disk(site: Site, sound: Path) -> Drilled:
    """A disk without room: a limit on the size of every file, which stops root too."""
    out = site.folder / "full_disk"
    shutil.copytree(sound, out)
    before = contents(out / "cases")
    claim = site.claim("full_disk", [BEFORE[0], BESIDE[0]])
    full = end(command(*_compare(claim, out, "--jobs", "1"), room=_ROOM))
    after, left = contents(out / "cases"), scraps(out / "cases")
    site.compare(claim, out)
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
            f"{', '.join(left)} was left in the folder": bool(left),
        },
    )


def drill_interrupt(site: Site, sound: Path) -> Drilled:
    """Ctrl-C while one engine hangs and the others have finished: to the whole group, as a terminal sends it."""
    out = site.folder / "interrupt"
    shutil.copytree(sound, out)
    before = contents(out / "cases")
    claim = site.claim("interrupt", [BEFORE[0], BESIDE[0]], faulty="waits_for_ctrl_c")
    process = command(*_compare(claim, out, "--jobs", "2"))
    begun = site.folder / "alive-waits_for_ctrl_c"
    expected = len(before) + 2  # the truth at the other point, and the engine
    wait_until(lambda: (begun.exists() and len(contents(out / "cases")) == expected) or process.poll() is not None)
    os.killpg(process.pid, signal.SIGINT)
    start = time.monotonic()
    ended = end(process)
    took = time.monotonic() - start
    after, left, alive = contents(out / "cases"), scraps(out / "cases"), site.alive("waits_for_ctrl_c")
    site.cure("waits_for_ctrl_c")
    site.compare(claim, out)
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
            f"it took {took:.0f} s to end": took > LIMIT / 4,
            f"{', '.join(left)} was left in the folder": bool(left),
            "a process of the engine lives on": alive,
        },
    )


def drill_two_runs(site: Site, sound: Path) -> Drilled:
    """Two commands that make the same results anew in one folder, at once."""
    out = site.folder / "two_runs"
    shutil.copytree(sound, out)
    claim = site.claim("two_runs", [BEFORE[0], *BESIDE])
    both = [end(process) for process in [command(*_compare(claim, out, "--fresh", "--jobs", "1")) for _ in range(2)]]
    after, left = contents(out / "cases"), scraps(out / "cases")
    records = [json.loads(path.read_text(encoding="utf-8")) for path in (out / "cases").glob("[!.]*.json")]
    site.runner(out / "cases").run([Case.from_dict(record["case"]) for record in records])
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
