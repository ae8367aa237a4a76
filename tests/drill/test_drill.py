"""The fault drill: once as a whole, as a person runs it; and that it notices what it is for."""

from __future__ import annotations

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from proofroll.core.plugins import engine_names
from proofroll.running.case import Case, Result
from proofroll.running.memory import descendants
from proofroll.running.store import Store
from proofroll_drill import engine_faults, process_faults
from proofroll_drill.engine_faults import ENGINE_FAULTS, drill_damage, drill_engine, prepare
from proofroll_drill.faults import within
from proofroll_drill.row import Drilled, drilled
from proofroll_drill.site import Site, site
from proofroll_drill.table import drill_table

# What must have happened in every drill.
TRIED = {
    "raises in build", "raises in built", "raises in advance", "raises in sample", "returns NaN",
    "returns wrong shapes", "hangs", "allocates without end", "segfaults", "aborts", "exits by sys.exit",
    "exits by os._exit", "writes half a result", "prints garbage", "floods its output", "writes into every file",
    "reads standard input", "leaves a process behind", "truncated record", "tampered record", "truncated trajectory",
    "tampered trajectory", "interrupt (Ctrl-C)", "full disk", "two runs in one folder", "is sent Ctrl-C",
    "calls a lack of memory divergence", "calls a file that is lacking a refusal", "commands the terminal",
    "another's result", "deeply nested record", "pipe for a record", "pipe for a trajectory", "device for a record",
    "device for a trajectory", "folder for a record", "folder for a trajectory", "is killed",
    "is killed during C code", "is hung up",
    "is killed with its pool", "dies while it stores",
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.timeout(900)  # 20 s of processor time, on a machine that may have much else to do
def test_every_fault_is_contained() -> None:
    """Each fault costs its own case alone and says so in a sentence; the next run makes only what is missing."""
    command = [sys.executable, "-m", "proofroll_drill", "faults", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    found = json.loads(done.stdout)
    rows = {row["fault"]: row for row in found["faults"]}
    assert rows.keys() == TRIED
    assert {name: row["problem"] for name, row in rows.items() if not row["contained"]} == {}
    assert (done.returncode, found["tried"], found["contained"]) == (0, len(TRIED), len(TRIED))
    # How far it is may be said, where it takes long.
    assert all(line.startswith("proofroll: ") and line.endswith(" s") for line in done.stderr.splitlines())
    for row in found["faults"]:
        assert row["said"]
        assert row["others_arrived"] == row["others"] > 0
        assert row["kept"] == row["stored"] > 0
        assert row["recomputed"] == row["missing"]
    assert sum(row["recomputed"] for row in found["faults"]) >= 18
    assert "drill" not in engine_names()


@pytest.fixture(scope="module")
def place() -> Iterator[tuple[Site, Path]]:
    """A site, with results that are there before."""
    with site() as here:
        yield here, prepare(here)


@pytest.mark.nightly
def test_a_damage_that_is_not_noticed(place: tuple[Site, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A store that believes whatever it finds does not pass."""

    def believe(self: Store, case: Case) -> Result:
        record = json.loads((self.folder / f"{case.key}.json").read_text())
        return Result.from_dict(record["result"])

    monkeypatch.setattr(Store, "get", believe)
    row = drill_damage(*place, "tampered record")
    assert not row.contained
    assert "the next run made 0 results instead of 1" in row.problem


@pytest.mark.drill
def test_a_half_result_that_is_left(place: tuple[Site, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A store that leaves half a file behind does not pass, nor does a row that says something else."""
    fault = next(fault for fault in ENGINE_FAULTS if fault.formulation == "half")
    other = engine_faults.EngineFault(fault.name, fault.formulation, fault.status, "ended well")
    monkeypatch.setattr("proofroll.running.store.shutil.rmtree", lambda *_, **__: None)
    row = drill_engine(*place, other)
    assert not row.contained
    assert "what was said is not one sentence with 'ended well'" in row.problem
    assert "was left in the folder" in row.problem


# Run by Python before any program of the drill: takes a safeguard out of proofroll in every process that is started.
TAKEN_OUT = {
    "whole files": """
import contextlib
import proofroll.files.atomic

@contextlib.contextmanager
def in_place(path):
    yield path

proofroll.files.atomic.replacing = in_place
""",
    "the watch over the parent": """
import proofroll.running.process_end

proofroll.running.process_end.end_with = lambda parent: None
""",
    "the end by the system": """
import proofroll.running.process_end

proofroll.running.process_end.end_with_pipe = lambda pipe: None
""",
}


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("taken_out", "drill", "problem"),
    [
        ("whole files", process_faults.drill_storing, "a stored result was lost or changed"),
        ("the watch over the parent", process_faults.drill_pool, "a process of the pool lives on"),
        ("the end by the system", process_faults.drill_killed_in_c, "a process of the engine lives on"),
    ],
)
def test_a_safeguard_that_is_taken_out(
    place: tuple[Site, Path],
    monkeypatch: pytest.MonkeyPatch,
    taken_out: str,
    drill: Callable[[Site, Path], Drilled],
    problem: str,
) -> None:
    """Without whole files, or without what ends a process with its parent, the fault that needs it is not contained."""
    here, sound = place
    customised = here.folder / "customised"
    customised.mkdir(exist_ok=True)
    (customised / "sitecustomize.py").write_text(TAKEN_OUT[taken_out])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(customised), os.environ["PYTHONPATH"]]))
    monkeypatch.setattr("proofroll_drill.site.GONE", 1.0)
    try:
        row = drill(here, sound)
    finally:
        _end_what_is_left(here)
    assert not row.contained
    assert problem in row.problem


def _end_what_is_left(here: Site) -> None:
    """Ends the processes of a drill that outlived their parents."""
    own = {os.getpid(), *descendants(os.getpid())}
    for place in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if int(place.parent.name) not in own and f"={here.folder}\0".encode() in place.read_bytes():
                os.kill(int(place.parent.name), signal.SIGKILL)


def test_a_fault_that_catches_the_drill_itself() -> None:
    """A drill that hangs or raises is a row that is not contained, and the others go on."""
    never = threading.Event()
    row = within("hangs", never.wait, 0.1)  # type: ignore[arg-type]  # it gives no row
    assert (row.contained, row.hung, row.problem) == (False, True, "the drill itself hung for 0.1 s")
    never.set()

    def fails() -> Drilled:
        raise OSError("no room")

    row = within("fails", fails)
    assert (row.contained, row.hung, row.said) == (False, False, "OSError: no room")


SOUND = {
    "said": "it ended",
    "expected": "ended",
    "others": [True, True],
    "before": {"a": "1"},
    "after": {"a": "1", "b": "2"},
    "again": {"a": "1", "b": "2", "c": "3"},
    "missing": 1,
    "problems": {"the house burnt down": False},
}


def judged(**changes: object) -> Drilled:
    """The verdict on what was sound but for some changes."""
    return drilled("fault", **{**SOUND, **changes})  # type: ignore[arg-type]  # of one type each


def test_a_sound_row() -> None:
    """A fault without any problem is contained and everything is counted."""
    assert judged() == Drilled("fault", True, "it ended", 2, 2, 2, 2, 1, 1, "")


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"said": "it ended\nbadly"}, "not one sentence"),
        ({"said": ""}, "not one sentence"),
        ({"expected": "crashed"}, "not one sentence with 'crashed'"),
        ({"others": [True, False]}, "did not arrive"),
        ({"before": {"a": "0"}}, "lost or changed"),
        ({"before": {"z": "1"}}, "lost or changed"),
        ({"again": {"a": "1", "b": "4", "c": "3"}}, "the next run lost or changed a result; the next run made 2"),
        ({"again": {"a": "1", "c": "3"}}, "the next run lost"),
        ({"missing": 0}, "made 1 results instead of 0"),
        ({"problems": {"the house burnt down": True}}, "the house burnt down"),
    ],
)
def test_what_is_not_contained(changes: dict[str, object], problem: str) -> None:
    """Each thing that may go wrong is a problem, and the row says which."""
    row = judged(**changes)
    assert not row.contained
    assert problem in row.problem


def test_table_for_a_person() -> None:
    """Every fault is a row on the terminal with its outcome, and one that is not contained has the reason."""
    from rich.console import Console

    out = io.StringIO()
    Console(file=out, width=100).print(drill_table([judged(), judged(missing=3)]))
    lines = out.getvalue().splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[1].split()[:5] == ["fault", "yes", "2/2", "2/2", "1/1"]
    assert "the next run made 1 results instead of 3" in " ".join(" ".join(lines).split())


@pytest.mark.nightly
def test_a_site_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a drill its folder is gone, the path is as it was and its engine is unheard of."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, ["somewhere", os.environ.get("PYTHONPATH")])))
    before, path = dict(os.environ), list(sys.path)
    with site() as here:
        assert here.folder.is_dir()
        assert here.facts["hangs"].settings["formulation"] == "hangs"
        assert dict(os.environ) != before
    assert not here.folder.exists()
    assert dict(os.environ) == before
    assert sys.path == path
