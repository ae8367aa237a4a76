"""Site of a drill: a temporary folder in which its engine is announced, with comparisons and cases of it."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from proofroll.files.atomic import ordinary_content
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, EngineFacts
from proofroll.running.engine_questions import resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll_drill.engines import DEEDS, FOLDER

SCENE = "sphere_in_cylinder"
# Speeds of the results that are there before anything goes wrong, and of the cases beside the fault [m/s].
BEFORE = (2.0, 3.0)
BESIDE = (4.0, 5.0)
_UNTIL, _EVERY = 0.1, 0.05
# A hang is ended after this [s]; elsewhere the limit must only be longer than any machine takes to start a worker.
HANG = 1.5
_LIMIT = 60.0
# Enough for any engine of the drill, start-up included, and little enough that no machine suffers [GB].
MEMORY = 0.5
# How long a process that was ended may take to be gone, on a machine that may have much else to do [s].
GONE = 60.0

_CLAIM = """
title = "The drill"
question = "Does the result arrive?"
scene = "{scene}"
until = {until}
every = {every}
timed = false
vary = {{ speed = {speeds} }}
tolerances.arrives = {{ because = "the drill asks whether a result is there, not how good it is", z = "1 m" }}
"""
_ROW = """
[[rows]]
engine = "drill[formulation={formulation}]"
tolerance = "arrives"
ladder = [1]
"""


@dataclass(frozen=True)
class Site:
    """The folder of a drill.

    Attributes:
        folder: in which every fault gets a folder of its own.
        facts: formulation of the engine -> its complete settings.
        workers: processes that outlived a fault and serve the next: to start one costs more than any fault.
    """

    folder: Path
    facts: dict[str, EngineFacts]
    workers: Workers

    def runner(self, store: Path) -> Runner:
        """Runs cases one after another and keeps their results in this folder."""
        runner = Runner(Store(store), jobs=1)
        runner.workers = self.workers
        return runner

    def compare(self, claim: Path, out: Path) -> None:
        """Runs ``proofroll compare`` on a comparison file, here."""
        compare(load_comparison(str(claim)), self.runner(out / "cases"))

    def case(self, formulation: str, speed: float, time_limit: float = _LIMIT) -> Case:
        """A short case of the drill's engine."""
        digest = load_scene(SCENE, speed=speed).digest
        return Case(SCENE, {"speed": speed}, digest, self.facts[formulation], _UNTIL, _EVERY, time_limit=time_limit)

    def sound_cases(self) -> list[Case]:
        """The cases that are there before anything goes wrong."""
        return [self.case("well", speed) for speed in BEFORE]

    def claim(self, name: str, speeds: Sequence[float], faulty: str = "") -> Path:
        """A comparison file of the sound engine at these speeds, and of a fault at the last."""
        text = _CLAIM.format(scene=SCENE, until=_UNTIL, every=_EVERY, speeds=list(speeds))
        path = self.folder / f"{name}.toml"
        text += _ROW.format(formulation="well")
        if faulty:
            text += _ROW.format(formulation=faulty) + f"only = {{ speed = [{speeds[-1]}] }}\n"
        path.write_text(text, encoding="utf-8")
        return path

    def cure(self, formulation: str) -> None:
        """The fault does not happen any more."""
        (self.folder / "cured" / formulation).touch()

    def alive(self, formulation: str) -> bool:
        """True if a process in which the fault happened, or a child of it, goes on living."""
        path = self.folder / f"alive-{formulation}"
        deadline = time.monotonic() + GONE
        while path.exists():
            with path.open() as file, contextlib.suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return False
            if time.monotonic() > deadline:
                return True
            time.sleep(0.05)
        return False


@contextlib.contextmanager
def site() -> Iterator[Site]:
    """A folder for a drill, with the drill's engine announced to every process that is started meanwhile."""
    folder = Path(tempfile.mkdtemp(prefix="proofroll-drill-"))
    before = {name: os.environ.get(name) for name in (FOLDER, "PYTHONPATH")}
    workers = Workers(MEMORY)
    try:
        (folder / "cured").mkdir()
        info = folder / "path" / "proofroll_drill_engine-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(
            "Metadata-Version: 2.1\nName: proofroll-drill-engine\nVersion: 1.0\n", encoding="utf-8"
        )
        (info / "entry_points.txt").write_text(
            "[proofroll.engines]\ndrill = proofroll_drill.engines:Drill\n", encoding="utf-8"
        )
        os.environ[FOLDER] = str(folder)
        sys.path.insert(0, str(info.parent))
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(info.parent), before["PYTHONPATH"]]))
        facts: dict[str, EngineFacts] = {}
        asked = resolve([("drill", {"formulation": name}) for name in DEEDS], workers)
        for formulation, found in zip(DEEDS, asked, strict=True):
            if not isinstance(found, EngineFacts):
                raise found
            facts[formulation] = found
        yield Site(folder, facts, workers)
    finally:
        workers.close()
        with contextlib.suppress(ValueError):
            sys.path.remove(str(folder / "path"))
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        shutil.rmtree(folder, ignore_errors=True)


def contents(store: Path) -> dict[str, str]:
    """Hash of each result in a folder of results, its record and trajectory together, by key."""
    found: dict[str, str] = {}
    for record in store.glob("[!.]*.json"):
        pair = hashlib.sha256()
        for path in (record, record.with_suffix(".npz")):
            with contextlib.suppress(OSError):  # it may be none, or no file
                pair.update(ordinary_content(path))
        found[record.stem] = pair.hexdigest()
    return found


def scraps(store: Path) -> list[str]:
    """Names of files in a folder of results that are no results."""
    return [path.name for path in store.iterdir() if path.suffix not in {".json", ".npz"} or path.name.startswith(".")]
