"""Faults around the command itself: a full disk, Ctrl-C, a second run into the same folder. Real processes."""

from __future__ import annotations

import os
import shutil
import signal
import time
from pathlib import Path

from proofroll_drill.processes import LIMIT, command, end, run, wait_until
from proofroll_drill.row import Drilled, drilled
from proofroll_drill.site import BEFORE, BESIDE, Site, contents, scraps

# A file on the full disk may have this many bytes: no result is so small.
_ROOM = 1024


def drill_full_disk(site: Site, sound: Path) -> Drilled:
    """A disk without room while results are made anew: a limit on the size of every file, which stops root too."""
    folder = site.folder / "full_disk"
    shutil.copytree(sound, folder)
    before = contents(folder)
    cases = [site.sound_cases()[0], site.case("well", BESIDE[0])]
    full = end(run(folder, cases, _ROOM))
    after, left = contents(folder), scraps(folder)
    said = [message.replace(str(folder), "…") for _, message in full.results.values()]
    mended = site.runner(folder).run(cases)
    return drilled(
        "full disk",
        said[0] if said else full.said,
        expected="cannot be written (File too large)",
        others=[result.status == "done" for result in mended.values()],
        before=before,
        after=after,
        again=contents(folder),
        missing=1,
        problems={
            full.said: full.code != 0,
            "the run did not end with it": {status for status, _ in full.results.values()} != {"unwritable"},
            f"{', '.join(left)} was left in the folder": bool(left),
        },
    )


def drill_interrupt(site: Site, sound: Path) -> Drilled:
    """Ctrl-C while one engine hangs and the others have finished: to the whole group, as a terminal sends it."""
    out = site.folder / "interrupt"
    shutil.copytree(sound, out / "cases")
    before = contents(out / "cases")
    claim = site.claim("interrupt", [BEFORE[0], BESIDE[0]], faulty="waits_for_ctrl_c")
    process = command("compare", claim, "--out", out, "--json", "--jobs", "1")
    begun = site.folder / "alive-waits_for_ctrl_c"
    expected = len(before) + 3  # the truth at both points, and the engine at the other
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
            f"it took {took:.0f} s to end": took > LIMIT / 2,
            f"{', '.join(left)} was left in the folder": bool(left),
            "a process of the engine lives on": alive,
        },
    )


def drill_two_runs(site: Site, sound: Path) -> Drilled:
    """Two programs that make the same results anew in one folder, at once."""
    folder = site.folder / "two_runs"
    shutil.copytree(sound, folder)
    cases = [*site.sound_cases(), *(site.case("well", speed) for speed in BESIDE)]
    both = [end(process) for process in [run(folder, cases) for _ in range(2)]]
    after, left = contents(folder), scraps(folder)
    site.runner(folder).run(cases)
    same = both[0].results == both[1].results
    return drilled(
        "two runs in one folder",
        f"{both[0].said} and {both[1].said}, {'the same' if same else 'other'} results",
        expected="exit code 0 and exit code 0, the same results",
        others=[status == "done" for ended in both for status, _ in ended.results.values()],
        before={},  # every result is made anew
        after=after,
        again=contents(folder),
        missing=0,
        problems={f"{', '.join(left)} was left in the folder": bool(left)},
    )
