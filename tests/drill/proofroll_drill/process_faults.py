"""Faults of the process that runs cases: it dies while it stores, while it waits, while a pool computes."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Mapping
from pathlib import Path

from proofroll.running.case import Case
from proofroll.running.memory import descendants
from proofroll_drill import site as site_module
from proofroll_drill.processes import alive, command, end, run, start, wait_until
from proofroll_drill.row import Drilled, drilled
from proofroll_drill.site import BEFORE, SCENE, Site, contents

# Two processes compute for longer than they are left alone, and the first result of theirs is told.
_MAP = """
import sys
from pathlib import Path
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.slip.regimes import regime_map

def tell(_):
    Path(sys.argv[1]).touch()

if __name__ == "__main__":
    speeds = [2.0 + 1e-3 * index for index in range(5000)]
    regime_map(load_scene("sphere_in_cylinder"), speeds, [0.2, 0.3], until=4.0, workers=2, progress=tell)
"""


def _judged(
    site: Site, name: str, folder: Path, case: Case, said: str, expected: str, problems: Mapping[str, bool]
) -> Drilled:
    """The row, after all results were asked for again in this process."""
    sound, after = contents(site.folder / "sound"), contents(folder)
    site.cure(case.engine.settings["formulation"])
    cases = [*site.sound_cases(), case]
    results = site.runner(folder).run(cases)
    return drilled(
        name,
        said,
        expected=expected,
        others=[results[one.key].status == "done" for one in cases],
        before=sound,
        after=after,
        again=contents(folder),
        missing=int(case.key not in sound),
        problems=problems,
    )


def drill_storing(site: Site, sound: Path) -> Drilled:
    """A process makes a result anew and is ended by the system in the middle of its record."""
    folder = site.folder / "dies_while_storing"
    shutil.copytree(sound, folder)
    case = site.case("well", BEFORE[0])
    half = (folder / f"{case.key}.json").stat().st_size // 2
    said = end(run(folder, [case], half, alone=True)).said
    return _judged(site, "dies while it stores", folder, case, said, "was killed by SIGXFSZ", {})


def drill_killed(site: Site, sound: Path) -> Drilled:
    """Kills the process that runs cases while the engine hangs: nothing is left to end the engine's process."""
    return _ended_by(signal.SIGKILL, site, sound, "is killed", "waits_for_its_parent", "was killed by SIGKILL")


def drill_killed_in_c(site: Site, sound: Path) -> Drilled:
    """Likewise, while no thread of Python can run in the process of the engine."""
    name, formulation = "is killed during C code", "computes_without_its_parent"
    return _ended_by(signal.SIGKILL, site, sound, name, formulation, "was killed by SIGKILL")


def drill_hung_up(site: Site, sound: Path) -> Drilled:
    """The terminal of a command is closed while the engine hangs."""
    expected = "exit code 130: proofroll: interrupted"
    return _ended_by(signal.SIGHUP, site, sound, "is hung up", "waits_for_its_terminal", expected)


def _ended_by(sent: signal.Signals, site: Site, sound: Path, name: str, formulation: str, expected: str) -> Drilled:
    folder = site.folder / formulation
    shutil.copytree(sound, folder)
    case = site.case(formulation, BEFORE[0])
    if sent is signal.SIGKILL:
        process = run(folder, [case])
    else:
        process = command("run", SCENE, "--engine", f"drill[formulation={formulation}]")
    begun = wait_until((site.folder / f"alive-{formulation}").exists)
    process.send_signal(sent)
    said = end(process).said
    problems = {"the engine did not begin": not begun, "a process of the engine lives on": site.alive(formulation)}
    return _judged(site, name, folder, case, said, expected, problems)


def drill_pool(site: Site, sound: Path) -> Drilled:
    """Kills a process that computes a map in a pool."""
    folder = site.folder / "pool"
    shutil.copytree(sound, folder)
    script = site.folder / "pool.py"  # a program whose processes are spawned must be a file
    script.write_text(_MAP, encoding="utf-8")
    begun = site.folder / "pool-has-begun"
    process = start(script, begun)
    wait_until(lambda: begun.exists() or process.poll() is not None)
    pool = descendants(process.pid)
    process.kill()
    ended = wait_until(lambda: not any(map(alive, pool)), site_module.GONE)
    for number in filter(alive, pool):
        os.kill(number, signal.SIGKILL)
    said = end(process).said.partition(":")[0]  # Python may go on about what its processes shared
    problems = {"the pool did not begin": not (begun.exists() and pool), "a process of the pool lives on": not ended}
    case = site.case("well", BEFORE[0])
    return _judged(site, "is killed with its pool", folder, case, said, "was killed by SIGKILL", problems)
