"""Hunt: random scenes one after another within a time, with the kinds of surprises that they show."""

from __future__ import annotations

import json
import shutil
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

from proofroll import InputError
from proofroll.core.errors import require_known
from proofroll.core.plugins import parse_engine, require_engine
from proofroll.files.json_data import plain
from proofroll.running.case import Status
from proofroll.running.engine_questions import describe
from proofroll.running.idle_workers import Workers
from proofroll.running.process import processor_seconds
from proofroll.running.runner import Runner
from proofroll.running.store import Store, write_text
from proofroll.studies.findings import load_findings
from proofroll_fuzz.drawing import Relation, SceneFamily, all_families, drawn_scene
from proofroll_fuzz.evaluation import EvaluatedScene, evaluate_scene
from proofroll_fuzz.relations import relations_of, write_scene
from proofroll_fuzz.shrink import Shrinker, SmallestScene
from proofroll_fuzz.surprises import REFUSES, TRUTH, Surprise

_KNOWN = "kinds.json"
_LIMIT = 20.0  # wall time of one run [s]
SHRINK = 45.0  # processor time for a kind [s]


@dataclass(frozen=True)
class FoundKind:
    """A kind of surprise of a hunt.

    Attributes:
        kind: its text.
        count: number of scenes that show it.
        new: False if an earlier hunt in the same folder has found it, or a finding about the engine has it.
        finding: name of that finding; empty: there is none.
        largest: its largest surprise.
        seed: of the first scene that shows it, or from which a shrink came upon it.
        folder: of that scene.
        first: its surprise in that scene.
        smallest: smallest scene that shows it; None: it was not shrunk.
    """

    kind: str
    count: int
    new: bool
    largest: Surprise
    seed: int
    folder: str
    first: Surprise
    smallest: SmallestScene | None = None
    finding: str = ""


@dataclass(frozen=True)
class Hunt:
    """Result of a hunt.

    Attributes:
        engine: as the user wrote it.
        first_seed: of the first scene.
        drawn: number of scenes.
        invalid: seeds of scenes that the reader refused.
        unfit: number of scenes that no formulation of the engine can represent; they were not run.
        without_truth: number of scenes whose truth has no result.
        seconds: processor time [s].
        kinds: the new ones first, those of findings last, then the largest.
        interrupted: True if the hunt was ended by a signal.
    """

    engine: str
    first_seed: int
    drawn: int = 0
    invalid: tuple[int, ...] = ()
    unfit: int = 0
    without_truth: int = 0
    seconds: float = 0.0
    kinds: tuple[FoundKind, ...] = field(default=())
    interrupted: bool = False

    @property
    def run(self) -> int:
        """Number of scenes that were run."""
        return self.drawn - len(self.invalid) - self.unfit

    @property
    def new(self) -> int:
        """Number of new kinds."""
        return sum(item.new for item in self.kinds)


def families_for(engine: str, names: tuple[str, ...], workers: Workers) -> dict[str, SceneFamily]:
    """Families of random scenes, with the features that some formulation of an engine provides.

    Args:
        engine: ``name`` or ``name[key=value,…]``; ``truth``: all features.
        names: of the families; empty: all.
        workers: pool for the question to the engine.

    Raises:
        InputError: there is no family of such a name, or no such engine.
        Missing: the engine is not installed.
    """
    families = all_families()
    for name in names:
        require_known("--family", name, families)
    chosen = {name: family for name, family in families.items() if name in names or not names}
    spec = parse_engine(engine)
    if spec.name == TRUTH:
        return chosen
    require_engine(spec.name, TRUTH)
    provides = describe(spec.name, workers).provides
    formulations = [spec.options["formulation"]] if "formulation" in spec.options else [*provides]
    provided = {capability for name in formulations for capability in provides.get(name, ())}
    able = {name: family.within(provided) for name, family in chosen.items() if family.needs & provided}
    if not able:
        raise InputError("engine", engine, f"it has no capability that scenes of {', '.join(chosen)} need")
    return able


def hunt(
    engine: str,
    folder: Path,
    *,
    minutes: float,
    seed: int = 0,
    families: tuple[str, ...] = (),
    shrink: float = SHRINK,
    jobs: int | None = None,
    workers: Workers | None = None,
    progress: Callable[[Hunt], object] = lambda _: None,
) -> Hunt:
    """Draws and runs scenes until their processor time is used up, or until it is interrupted.

    Scenes with a kind of surprise that is the first of its kind are kept in a folder of their seed. New kinds are
    shrunk, the largest first, in at most half of the time.

    Args:
        engine: ``name`` or ``name[key=value,…]``; ``truth``: the truth alone, held against a relation, too.
        folder: for the scenes that are kept, and for the kinds that later hunts know.
        minutes: processor time [min].
        seed: of the first scene.
        families: names of families; empty: all.
        shrink: processor time for each new kind [s]; 0: none is shrunk.
        jobs: workers at once; None: one for each core.
        workers: pool; None: new ones.
        progress: called after each scene and each shrink with the hunt so far.

    Raises:
        InputError: there is no such engine, setting or family, or a number makes no sense.
    """
    if not 0 < minutes < float("inf"):
        raise InputError("--minutes", minutes, "give a positive, finite number of minutes")
    if not 0 <= shrink < float("inf"):
        raise InputError("--shrink", shrink, "give a finite number of seconds; 0 shrinks nothing")
    if seed < 0:
        raise InputError("--seed", seed, "give a whole number from 0 on")
    workers = workers or Workers()
    hunting = _Hunting(
        engine=engine,
        folder=folder,
        families=families_for(engine, families, workers),
        known_kinds=_known(folder),
        result=Hunt(engine, seed),
    )
    with tempfile.TemporaryDirectory() as temporary:
        hunting.temporary = Path(temporary)
        runner = Runner(Store(hunting.temporary / "cases"), jobs=jobs, workers=workers)
        try:
            while hunting.result.seconds < 60 * minutes:
                hunting.step(runner, shrink)
                shutil.rmtree(hunting.temporary)
                runner.store.folder.mkdir(parents=True)
                progress(hunting.result)
        except KeyboardInterrupt:
            hunting.result = replace(hunting.result, interrupted=True)
    return hunting.result


@dataclass
class _Hunting:
    """A hunt that goes on.

    Attributes:
        engine, folder: as of :func:`hunt`.
        families: drawn ones, by name.
        known_kinds: kind -> folder, of earlier hunts.
        result: so far.
        temporary: folder for the scene that is run.
        shrunk: kinds that were shrunk, or began to be.
        shrinking: processor time of shrinks [s].
    """

    engine: str
    folder: Path
    families: Mapping[str, SceneFamily]
    known_kinds: Mapping[str, str]
    result: Hunt
    temporary: Path = Path()
    shrunk: set[str] = field(default_factory=set)
    shrinking: float = 0.0

    def step(self, runner: Runner, budget: float) -> None:
        """Shrinks the largest new kind, or runs the next scene while shrinks have used half of the time."""
        waiting = [item for item in self.result.kinds if item.new and item.kind not in self.shrunk]
        waiting = [item for item in waiting if item.first.kind.surprise != REFUSES]  # whose message tells the cause
        if budget and waiting and self.shrinking <= self.result.seconds / 2:
            self._shrink(waiting[0], runner, budget)
        else:
            self._draw(runner)
        if self.result.kinds:
            _remember(self.folder, self.result, self.known_kinds)

    def _draw(self, runner: Runner) -> None:
        number = self.result.first_seed + self.result.drawn
        drawn, place = self.temporary / str(number), self.folder / str(number)
        scene = drawn_scene(self.families, number)
        write_scene(drawn, scene.tables)
        relations: dict[str, Relation] = {}
        if self.engine == TRUTH:
            able = relations_of(self.families[scene.family])
            name = sorted(able)[number // len(self.families) % len(able)]
            relations[name] = able[name]
        evaluated = evaluate_scene(drawn, self.engine, runner, _LIMIT, relations)
        self.result = _with_scene(self.result, evaluated, number, place, self.known_kinds)
        if evaluated.invalid or any(item.seed == number for item in self.result.kinds):
            shutil.copytree(drawn, place, dirs_exist_ok=True)

    def _shrink(self, kind: FoundKind, runner: Runner, budget: float) -> None:
        self.shrunk.add(kind.kind)
        begin, place = processor_seconds(), Path(kind.folder)
        tables = tomllib.loads((place / "scene.toml").read_text(encoding="utf-8"))
        family = self.families[drawn_scene(self.families, kind.seed).family]

        def other(tables: Mapping[str, Any], surprise: Surprise) -> None:
            """Keeps a further kind that a shrink came upon."""
            if any(item.kind == str(surprise.kind) for item in self.result.kinds):
                return
            beside = self.folder / str(kind.seed) / f"beside-{len(self.result.kinds)}"
            write_scene(beside, tables)
            further = EvaluatedScene(surprises=(surprise,))
            self.result = _with_kinds(self.result, further, kind.seed, beside, self.known_kinds)

        shrinker = Shrinker(
            kind.first, self.engine, family, self.temporary, runner, limit=_LIMIT, budget=budget, other=other
        )
        smallest = shrinker.shrink(tables, place)
        seconds = processor_seconds() - begin
        self.shrinking += seconds
        kinds = [replace(item, smallest=smallest) if item.kind == kind.kind else item for item in self.result.kinds]
        self.result = replace(self.result, kinds=tuple(kinds), seconds=self.result.seconds + seconds)


def _with_kinds(
    result: Hunt, evaluated: EvaluatedScene, seed: int, folder: Path, known_kinds: Mapping[str, str]
) -> Hunt:
    """The hunt with the surprises of a further scene."""
    kinds = {item.kind: item for item in result.kinds}
    for surprise in evaluated.surprises:
        text = str(surprise.kind)
        kind = kinds.get(text) or FoundKind(
            kind=text,
            count=0,
            new=text not in known_kinds and not finding_of(text),
            largest=surprise,
            seed=seed,
            folder=str(folder),
            first=surprise,
            finding=finding_of(text),
        )
        largest = max(kind.largest, surprise, key=lambda item: item.size)
        kinds[text] = replace(kind, count=kind.count + 1, largest=largest)
    return replace(
        result,
        kinds=tuple(
            sorted(kinds.values(), key=lambda item: (not item.new, item.finding, -item.largest.size, item.seed))
        ),
    )


def _with_scene(
    result: Hunt, evaluated: EvaluatedScene, seed: int, folder: Path, known_kinds: Mapping[str, str]
) -> Hunt:
    """The hunt with a further scene."""
    return replace(
        _with_kinds(result, evaluated, seed, folder, known_kinds),
        drawn=result.drawn + 1,
        invalid=(*result.invalid, seed) if evaluated.invalid else result.invalid,
        unfit=result.unfit + (not evaluated.fits),
        without_truth=result.without_truth + (evaluated.truth not in {None, Status.DONE}),
        seconds=result.seconds + evaluated.seconds,
    )


@cache
def finding_of(kind: str) -> str:
    """Name of the finding about an engine that shows as a kind of surprise; empty: there is none."""
    return next((item.name for item in load_findings() if any(fnmatchcase(kind, text) for text in item.kinds)), "")


def _known(folder: Path) -> dict[str, str]:
    """Kinds that earlier hunts in a folder found -> folder of the first scene that shows each.

    Raises:
        InputError: their file is broken.
    """
    path = folder / _KNOWN
    if not path.exists():
        return {}
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return {str(kind): str(place) for kind, place in content.items()}
    except (OSError, ValueError, AttributeError) as error:
        raise InputError("--out", path, f"the kinds of earlier hunts cannot be read ({error}); remove it") from None


def _remember(folder: Path, result: Hunt, known_kinds: Mapping[str, str]) -> None:
    """Writes the kinds that the next hunt knows."""
    kinds = {item.kind: item.folder for item in result.kinds} | dict(known_kinds)
    write_text(folder / _KNOWN, json.dumps(plain(kinds), indent=1, ensure_ascii=False) + "\n")
