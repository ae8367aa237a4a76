"""Faults of an engine in its process, and of stored results; each in a runner of its own."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from proofroll.report.terminal.screen import Screen
from proofroll.running.case import LASTING, Status
from proofroll.running.store import Store
from proofroll_drill.row import Drilled, drilled
from proofroll_drill.site import BEFORE, BESIDE, HANG, MEMORY, Site, contents, scraps


@dataclass(frozen=True)
class EngineFault:
    """A fault of the engine.

    Attributes:
        name: for a person.
        formulation: of the drill's engine.
        status, words: required status of the row, and words of its message.
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
    EngineFault("returns wrong shapes", "wrong_shape", Status.DIVERGED, "p_WB with shape (2,) instead of (3,)"),
    EngineFault("hangs", "hangs", Status.TIMEOUT, f"no result within {HANG:g} s"),
    EngineFault("allocates without end", "allocates", Status.CRASHED, f"needed more than {MEMORY:g} GB of memory"),
    EngineFault("segfaults", "segfaults", Status.CRASHED, "was killed by SIGSEGV"),
    EngineFault("aborts", "aborts", Status.CRASHED, "was killed by SIGABRT"),
    EngineFault("exits by sys.exit", "says_exit", Status.CRASHED, "ended with exit code 1: no licence"),
    EngineFault("exits by os._exit", "exits", Status.CRASHED, "ended with exit code 7"),
    EngineFault("writes half a result", "half", Status.CRASHED, "was killed by SIGXFSZ"),
    EngineFault("prints garbage", "garbage", Status.DONE, "reached 0.1 s"),
    EngineFault("floods its output", "floods", Status.DONE, "reached 0.1 s"),
    EngineFault("writes into every file", "writes_everywhere", Status.CRASHED, "wrote into the answers"),
    EngineFault("reads standard input", "asks", Status.CRASHED, "EOFError"),
    EngineFault("is sent Ctrl-C", "interrupted", Status.CRASHED, "was killed by SIGINT"),
    EngineFault("calls a lack of memory divergence", "no_memory", Status.CRASHED, "it diverged (MemoryError)"),
    EngineFault("calls a file that is lacking a refusal", "no_file", Status.CRASHED, "it refuses (FileNotFoundError)"),
    EngineFault("commands the terminal", "commands", Status.DIVERGED, "all is well"),
    EngineFault("leaves a process behind", "leaves_a_child", Status.CRASHED, "ended with exit code 9"),
)


def drill_engine(site: Site, sound: Path, fault: EngineFault) -> Drilled:
    """Runs a case with the fault between others, then all of them again without the fault.

    Args:
        site: of the drill.
        sound: a folder of results that are there before, :func:`prepare`.
        fault: name of the fault.
    """
    folder = site.folder / fault.formulation
    shutil.copytree(sound, folder)
    before = contents(folder)
    faulty = site.case(fault.formulation, BEFORE[0])
    if fault.status is Status.TIMEOUT:
        faulty = dataclasses.replace(faulty, time_limit=HANG)
    beside, there = [site.case("well", speed) for speed in BESIDE], site.sound_cases()
    results = site.runner(folder).run([beside[0], faulty, *beside[1:], *there])
    found = results[faulty.key]
    after, left, alive = contents(folder), scraps(folder), site.alive(fault.formulation)
    site.cure(fault.formulation)
    cases = [*there, *beside, site.case(fault.formulation, BEFORE[0])]
    rerun = site.runner(folder).run(cases)
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
            "the terminal would obey what was said": _commands(found.message),
            "the next run did not mend it": not lasting and rerun[faulty.key].status is not Status.DONE,
        },
    )


def _commands(said: str) -> bool:
    """True if a terminal that shows this gets more than text."""
    shown = io.StringIO()
    Screen(file=shown, color_system=None).print(said, markup=False)
    return not shown.getvalue().replace("\n", "").isprintable()


def prepare(site: Site) -> Path:
    """A folder with results that are there before anything goes wrong."""
    folder = site.folder / "sound"
    site.runner(folder).run(site.sound_cases())
    return folder


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


def _take_another(path: Path) -> None:
    other = next(record for record in path.parent.glob("*.json") if record.stem != path.stem)
    for suffix in (".json", ".npz"):
        shutil.copy(other.with_suffix(suffix), path.with_suffix(suffix))


def _nest(path: Path) -> None:
    path.write_text("[" * 100_000, encoding="utf-8")


def _put_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _put_device(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def _put_folder(path: Path) -> None:
    path.unlink()
    (path / "something").mkdir(parents=True)


DAMAGES: Mapping[str, tuple[str, Callable[[Path], None]]] = {
    "truncated record": (".json", _cut),
    "tampered record": (".json", _change_record),
    "truncated trajectory": (".npz", _cut),
    "tampered trajectory": (".npz", _change_trajectory),
    "another's result": (".json", _take_another),
    "deeply nested record": (".json", _nest),
    "pipe for a record": (".json", _put_pipe),
    "pipe for a trajectory": (".npz", _put_pipe),
    "device for a record": (".json", _put_device),
    "device for a trajectory": (".npz", _put_device),
    "folder for a record": (".json", _put_folder),
    "folder for a trajectory": (".npz", _put_folder),
}


def drill_damage(site: Site, sound: Path, name: str) -> Drilled:
    """Damages one stored result of two, and runs both again."""
    folder = site.folder / name.replace(" ", "_")
    shutil.copytree(sound, folder)
    cases = site.sound_cases()
    damaged = cases[0]
    suffix, damage = DAMAGES[name]
    damage(folder / f"{damaged.key}{suffix}")
    sound_ones = contents(folder)
    spoilt = sound_ones.pop(damaged.key)
    runner = site.runner(folder)
    results = runner.run(cases)
    found = results[damaged.key]
    return drilled(
        name,
        found.message,
        expected="what was stored was damaged",
        others=[results[case.key].status is Status.DONE for case in cases[1:]],
        before=sound_ones,
        after=sound_ones,
        again={key: content for key, content in contents(folder).items() if (key, content) != (damaged.key, spoilt)},
        missing=1,
        problems={
            f"the case ended as {found.status.value}": found.status is not Status.DONE,
            "the damaged result was reused": runner.reused != len(cases) - 1,
            "the result was not stored again": Store(folder).get(damaged) is None,
            "there are scraps in the folder": bool(scraps(folder)),
        },
    )
