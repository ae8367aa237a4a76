"""Hunt: random scenes one after another within a time, with the kinds of surprises that they show."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from proofroll.core.drawing import SceneFamily, all_families, drawn_scene
from proofroll.core.errors import InputError, require_known
from proofroll.core.plugins import load_element_kinds, parse_engine, require_engine
from proofroll.files.json_data import plain
from proofroll.running.case import Status
from proofroll.running.engine_questions import describe
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store, write_text
from proofroll.studies.fuzz.evaluation import EvaluatedScene, evaluate_scene, write_scene
from proofroll.studies.fuzz.surprises import TRUTH, Surprise

_KNOWN = "kinds.json"
_LIMIT = 20.0  # wall time of one run [s]


@dataclass(frozen=True)
class FoundKind:
    """A kind of surprise of a hunt.

    Attributes:
        kind: its text.
        count: number of scenes that show it.
        new: False if an earlier hunt in the same folder has found it.
        largest: its largest surprise.
        seed: of the first scene that shows it.
        folder: of that scene.
    """

    kind: str
    count: int
    new: bool
    largest: Surprise
    seed: int
    folder: str


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
        kinds: the new ones first, then the largest.
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
    families = dict(all_families(load_element_kinds()))
    for name in names:
        require_known("--family", name, families)
    chosen = {name: family for name, family in families.items() if name in names or not names}
    spec = parse_engine(engine)
    if spec.name == TRUTH:
        return chosen
    require_engine(spec.name)
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
    jobs: int | None = None,
    workers: Workers | None = None,
    progress: Callable[[Hunt], object] = lambda _: None,
) -> Hunt:
    """Draws and runs scenes until their processor time is used up, or until it is interrupted.

    Scenes with a kind of surprise that is the first of its kind are kept in a folder of their seed.

    Args:
        engine: ``name`` or ``name[key=value,…]``; ``truth``: the truth alone.
        folder: for the scenes that are kept, and for the kinds that later hunts know.
        minutes: processor time [min].
        seed: of the first scene.
        families: names of families; empty: all.
        jobs: workers at once; None: one for each core.
        workers: pool; None: new ones.
        progress: called after each scene with the hunt so far.

    Raises:
        InputError: there is no such engine, setting or family, or a number makes no sense.
    """
    if not 0 < minutes < float("inf"):
        raise InputError("--minutes", minutes, "give a positive, finite number of minutes")
    if seed < 0:
        raise InputError("--seed", seed, "give a whole number from 0 on")
    workers = workers or Workers()
    chosen = families_for(engine, families, workers)
    known_kinds = _known(folder)
    result = Hunt(engine, seed)
    with tempfile.TemporaryDirectory() as temporary:
        runner = Runner(Store(Path(temporary) / "cases"), jobs=jobs, workers=workers)
        try:
            while result.seconds < 60 * minutes:
                number = seed + result.drawn
                drawn, place = Path(temporary) / str(number), folder / str(number)
                write_scene(drawn, drawn_scene(chosen, number).tables)
                evaluated = evaluate_scene(drawn, engine, runner, _LIMIT)
                result = _with_scene(result, evaluated, number, place, known_kinds)
                if evaluated.invalid or any(item.seed == number for item in result.kinds):
                    shutil.copytree(drawn, place, dirs_exist_ok=True)
                    _remember(folder, result, known_kinds)
                shutil.rmtree(drawn)
                shutil.rmtree(Path(temporary) / "cases", ignore_errors=True)
                runner.store.folder.mkdir()
                progress(result)
        except KeyboardInterrupt:
            result = replace(result, interrupted=True)
    return result


def _with_scene(
    result: Hunt, evaluated: EvaluatedScene, seed: int, folder: Path, known_kinds: Mapping[str, str]
) -> Hunt:
    """The hunt with a further scene."""
    kinds = {item.kind: item for item in result.kinds}
    for surprise in evaluated.surprises:
        text = str(surprise.kind)
        kind = kinds.get(text) or FoundKind(
            kind=text, count=0, new=text not in known_kinds, largest=surprise, seed=seed, folder=str(folder)
        )
        largest = max(kind.largest, surprise, key=lambda item: item.size)
        kinds[text] = replace(kind, count=kind.count + 1, largest=largest)
    return replace(
        result,
        drawn=result.drawn + 1,
        invalid=(*result.invalid, seed) if evaluated.invalid else result.invalid,
        unfit=result.unfit + (not evaluated.fits),
        without_truth=result.without_truth + (evaluated.truth not in {None, Status.DONE}),
        seconds=result.seconds + evaluated.seconds,
        kinds=tuple(sorted(kinds.values(), key=lambda item: (not item.new, -item.largest.size, item.seed))),
    )


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
