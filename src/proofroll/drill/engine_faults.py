"""What an engine can do to its process, and what can happen to a stored result; each in a runner of its own."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from proofroll.drill.row import Drilled, drilled
from proofroll.drill.site import BEFORE, BESIDE, HANG, Site, contents, scraps
from proofroll.running.case import LASTING, Case, Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store

# Enough for any engine of the drill, start-up included, and little enough that no machine suffers [GB].
_MEMORY = 0.8


@dataclass(frozen=True)
class EngineFault:
    """A fault of the engine.

    Attributes:
        name: for a person.
        formulation: of the drill's engine.
        status, words: how the row must end, and what it must say.
    """

    name: str
    formulation: str
    status: Status
    words: str


_SINGULAR = "RuntimeError: the matrix is singular and this is a second line"
ENGINE_FAULTS = (
    EngineFault("raises in build", "raises_in_build", Status.CRASHED, _SINGULAR),
    EngineFault("raises in built", "raises_in_built", Status.CRASHED, _SINGULAR),
    EngineFault("raises in advance", "raises_in_advance", Status.CRASHED, _SINGULAR),
    EngineFault("raises in sample", "raises_in_sample", Status.CRASHED, _SINGULAR),
    EngineFault("returns NaN", "nan", Status.DIVERGED, "v_WB is not finite (NaN or overflow) at 0.05 s"),
    EngineFault("returns wrong shapes", "wrong_shape", Status.DIVERGED, "p_WB with shape (1, 3) instead of (3,)"),
    EngineFault("hangs", "hangs", Status.TIMEOUT, f"no result within {HANG:g} s"),
    EngineFault("allocates without end", "allocates", Status.CRASHED, f"needed more than {_MEMORY:g} GB of memory"),
    EngineFault("segfaults", "segfaults", Status.CRASHED, "was killed by SIGSEGV"),
    EngineFault("aborts", "aborts", Status.CRASHED, "was killed by SIGABRT"),
    EngineFault("exits by sys.exit", "says_exit", Status.CRASHED, "ended with exit code 1: no licence"),
    EngineFault("exits by os._exit", "exits", Status.CRASHED, "ended with exit code 7"),
    EngineFault("writes half a result", "half", Status.CRASHED, "was killed by SIGXFSZ"),
    EngineFault("prints garbage", "garbage", Status.DONE, "reached 0.1 s"),
    EngineFault("floods its output", "floods", Status.DONE, "reached 0.1 s"),
    EngineFault("writes into every file", "writes_everywhere", Status.CRASHED, "wrote into the answers"),
    EngineFault("reads standard input", "asks", Status.CRASHED, "EOFError"),
    EngineFault("leaves a process behind", "leaves_a_child", Status.CRASHED, "ended with exit code 9"),
)


def drill_engine(site: Site, sound: Path, fault: EngineFault) -> Drilled:
    """Runs a case with the fault between others, then all of them again without the fault.

    Args:
        site: of the drill.
        sound: a folder of results that are there before, :func:`prepare`.
        fault: what happens.
    """
    folder = site.folder / fault.formulation
    shutil.copytree(sound, folder)
    before = contents(folder)
    faulty = site.case(fault.formulation, BEFORE[0])
    if fault.status is Status.TIMEOUT:
        faulty = dataclasses.replace(faulty, time_limit=HANG)
    beside, there = [site.case("well", speed) for speed in BESIDE], _sound_cases(site)
    results = Runner(Store(folder), jobs=1, memory=_MEMORY).run([beside[0], faulty, *beside[1:], *there])
    found = results[faulty.key]
    after, left, alive = contents(folder), scraps(folder), site.alive(fault.formulation)
    site.cure(fault.formulation)
    cases = [*there, *beside, site.case(fault.formulation, BEFORE[0])]
    rerun = Runner(Store(folder), jobs=1, memory=_MEMORY).run(cases)
    lasting = fault.status in LASTING
    return drilled(
        fault.name,
        found.message,
        expected=fault.words,
        others=[results[case.key].status is Status.DONE for case in (*there, *beside)],
        before=before,
        after=after,
        again=contents(folder),
        missing=0 if lasting else 1,
        problems={
            f"the case ended as {found.status.value}": found.status is not fault.status,
            f"{', '.join(left)} was left in the folder": bool(left),
            "a process of the engine lives on": alive,
            "the next run did not mend it": not lasting and rerun[faulty.key].status is not Status.DONE,
        },
    )


def prepare(site: Site) -> Path:
    """A folder with results that are there before anything goes wrong."""
    folder = site.folder / "sound"
    Runner(Store(folder), jobs=1).run(_sound_cases(site))
    return folder


def _sound_cases(site: Site) -> list[Case]:
    return [site.case("well", speed) for speed in BEFORE]


def _cut(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def _change_record(path: Path) -> None:
    record = json.loads(path.read_text(encoding="utf-8"))
    record["result"]["wall_seconds"] = 1e-9
    path.write_text(json.dumps(record), encoding="utf-8")


def _change_trajectory(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


DAMAGES: Mapping[str, tuple[str, Callable[[Path], None]]] = {
    "truncated record": (".json", _cut),
    "tampered record": (".json", _change_record),
    "truncated trajectory": (".nc", _cut),
    "tampered trajectory": (".nc", _change_trajectory),
}


def drill_damage(site: Site, sound: Path, name: str) -> Drilled:
    """Damages one stored result of two, and runs both again."""
    folder = site.folder / name.replace(" ", "_")
    shutil.copytree(sound, folder)
    cases = _sound_cases(site)
    damaged = cases[0]
    suffix, damage = DAMAGES[name]
    damage(folder / f"{damaged.key}{suffix}")
    sound_ones = contents(folder)
    spoilt = sound_ones.pop(damaged.key)
    runner = Runner(Store(folder), jobs=1)
    results = runner.run(cases)
    found = results[damaged.key]
    return drilled(
        name,
        found.message,
        expected="what was stored was damaged",
        others=[results[case.key].status is Status.DONE for case in cases[1:]],
        before=sound_ones,
        after=sound_ones,
        again={key: content for key, content in contents(folder).items() if content != spoilt},
        missing=1,
        problems={
            f"the case ended as {found.status.value}": found.status is not Status.DONE,
            "the damaged result was reused": runner.reused != len(cases) - 1,
            "the result was not stored again": Store(folder).get(damaged) is None,
            "there are scraps in the folder": bool(scraps(folder)),
        },
    )
