"""Shrinks a scene that shows a surprise, and looks for the nearest scene that does not."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from proofroll.core.element_abilities import WritesPrograms
from proofroll.core.plugins import parse_engine
from proofroll.core.program_text import FailedRun
from proofroll.running.case import Status
from proofroll.running.engine_questions import programs
from proofroll.running.process import processor_seconds
from proofroll.running.runner import Runner
from proofroll.running.store import write_text
from proofroll.studies.failure import CRASHED, GAVE_UP, LOST_PHASE, Yardstick, run_outcome
from proofroll_fuzz.drawing import Change, Relation, SceneFamily
from proofroll_fuzz.evaluation import EvaluatedScene, evaluate_scene, outcome_of
from proofroll_fuzz.relations import relations_of, write_scene
from proofroll_fuzz.surprises import HANGS, OURS, TRUTH, Surprise

_DECADE = 1.0  # by which the size of a surprise may change
_TIMES = 3.0  # limit of a try, relative to the first run of the scene
_LEAST_LIMIT = 3.0  # s
_NEAREST = 0.5  # part of the budget of a shrink for the nearest scene, beyond it
_COMPUTED = 9  # digits from which on a number was computed from others, as the end that closes a loop
_LEAST_ERROR = 1e-6  # of the places, relative to their range, that a program can show


@dataclass(frozen=True)
class SmallestScene:
    """Smallest scene found that shows a surprise.

    Attributes:
        folder: of the scene.
        tables: number of tables in its file.
        digits: most digits of its numbers; those computed from others do not count.
        tries, kept: changes that were tried, and that kept the surprise.
        seconds: processor time [s].
        nearest: clause on the nearest scene without the surprise; empty: none was found.
        program: path of a program that shows the surprise; empty: there is none.
    """

    folder: str
    tables: int
    digits: int
    tries: int
    kept: int
    seconds: float
    nearest: str = ""
    program: str = ""


class Shrinker:
    """Shrinks scenes with one surprise.

    Args:
        surprise: its kind is kept, and its size within a decade.
        engine: as the user wrote it.
        family: of the scene.
        temporary: folder for tries.
        runner: of the cases.
        limit: wall time of one run [s].
        budget: processor time [s].
        other: called with tables and surprise where a try shows another surprise.
    """

    def __init__(
        self,
        surprise: Surprise,
        engine: str,
        family: SceneFamily,
        temporary: Path,
        runner: Runner,
        *,
        limit: float,
        budget: float,
        other: Callable[[Mapping[str, Any], Surprise], object] = lambda *_: None,
    ) -> None:
        self._surprise, self._family, self._folder, self._runner = surprise, family, temporary / "try", runner
        self._limit, self._budget, self._other = limit, budget, other
        self._engine = _engine_of(surprise, engine)
        self._begin, self.tries, self.kept = processor_seconds(), 0, 0

    @property
    def seconds(self) -> float:
        """Processor time since the beginning [s]."""
        return processor_seconds() - self._begin

    def shrink(self, tables: Mapping[str, Any], folder: Path) -> SmallestScene:
        """Writes the smallest scene into ``folder/smallest``, and the nearest one without the surprise beside it."""
        full = self._limit
        smallest = self._shrunk(tables)
        self._limit = full
        if smallest != tables and not self._shows(self._evaluated(smallest)):  # with the time of a whole run
            smallest = tables
        place = folder / "smallest"
        number = 1
        while place.exists():
            number += 1
            place = folder / f"smallest-{number}"
        write_scene(place, smallest)
        words, nearest = self._nearest(smallest)
        if nearest is not None:
            write_scene(place / "nearest", nearest)
        return SmallestScene(
            folder=str(place),
            tables=sum(len(item) if isinstance(item, list) else 1 for item in smallest.values() if _is_table(item)),
            digits=_most_digits(smallest),
            tries=self.tries,
            kept=self.kept,
            seconds=self.seconds,
            nearest=words,
            program=self._program(place),
        )

    def _shrunk(self, tables: Mapping[str, Any]) -> Mapping[str, Any]:
        """Smaller tables by one change after another, until none keeps the surprise or the time is used up."""
        begin = processor_seconds()
        if not self._shows(self._evaluated(tables)):
            return tables
        self._limit = min(self._limit, max(_LEAST_LIMIT, _TIMES * (processor_seconds() - begin)))
        seen, progress = {_text(tables)}, True
        while progress:
            progress = False
            for change in self._family.smaller(tables):
                for candidate in self._changed(tables, change):
                    if self.seconds > self._budget:
                        return tables
                    if _text(candidate) in seen:
                        break
                    seen.add(_text(candidate))
                    evaluated = self._evaluated(candidate)
                    if self._shows(evaluated):
                        tables, progress = candidate, True
                        self.kept += 1
                    else:
                        self._pass_on(candidate, evaluated)
                    if not evaluated.invalid:
                        break
        return tables

    def _changed(self, tables: Mapping[str, Any], change: Change) -> Iterator[dict[str, Any]]:
        """The tables after a change, then closed anew; none where the change does not apply."""
        for closing in (False, True):
            candidate = deepcopy(dict(tables))
            try:
                change(candidate)
                if closing:
                    self._family.close(candidate, tables)
            except (LookupError, StopIteration, TypeError, ValueError):
                return
            yield candidate

    def _evaluated(self, tables: Mapping[str, Any]) -> EvaluatedScene:
        self.tries += 1
        write_scene(self._folder, tables)
        relations: dict[str, Relation] = {}
        if name := self._surprise.kind.relation:
            relations[name] = relations_of(self._family)[name]
        return evaluate_scene(self._folder, self._engine, self._runner, self._limit, relations, diagnosing=False)

    def _shows(self, evaluated: EvaluatedScene) -> bool:
        """True if a scene shows the surprise."""
        target = self._surprise
        return any(item.kind == target.kind and abs(item.size - target.size) <= _DECADE for item in evaluated.surprises)

    def _nearest(self, smallest: Mapping[str, Any]) -> tuple[str, Mapping[str, Any] | None]:
        """Clause on the nearest scene without any surprise, and its tables; None: none was found in time."""
        end = self.seconds + _NEAREST * self._budget
        for words, change in self._family.nearest(smallest):
            for candidate in self._changed(smallest, change):
                if self.seconds > end:
                    return "", None
                evaluated = self._evaluated(candidate)
                self._pass_on(candidate, evaluated)
                if evaluated.fits and evaluated.truth is Status.DONE and not evaluated.surprises:
                    return f"passes {words or f'with {_difference(smallest, candidate)}'}", candidate
                if not evaluated.invalid:
                    break
        return "", None

    def _pass_on(self, tables: Mapping[str, Any], evaluated: EvaluatedScene) -> None:
        """Passes other surprises on, without hangs: a try has less time than a run."""
        for item in evaluated.surprises:
            if item.kind != self._surprise.kind and item.kind.surprise != HANGS:
                self._other(tables, item)

    def _program(self, folder: Path) -> str:
        """Path of a program that shows the failure by the engine alone, or as far as it can; empty: there is none."""
        if self._surprise.kind.formulation == OURS:
            return ""
        outcome = outcome_of(folder, self._engine, self._runner, self._limit)
        run = next(iter(outcome.runs), None) if outcome else None
        if outcome is None or run is None or run.case is None or run.case.engine.resolution is None:
            return ""
        (point,), (element, *_) = outcome.points.values(), outcome.scene.elements
        if point.reference is None or not isinstance(element, WritesPrograms):
            return ""
        truth = point.reference.dataset
        measured = Yardstick.of(point.scene, truth)
        error = 0.0
        if run.result.status is Status.DONE and run.trajectory is not None:
            error = run_outcome(run.result, run.trajectory.dataset, measured).error or 0.0
        failure = {Status.DIVERGED: GAVE_UP, Status.CRASHED: CRASHED, Status.DONE: LOST_PHASE}.get(run.result.status)
        if failure is None or (failure is LOST_PHASE and not error > _LEAST_ERROR):
            return ""
        ((source, reason),) = programs([run.case], self._runner.workers)
        facts = run.case.engine
        failed = FailedRun(
            scene=str(folder),
            parameters={},
            engine=facts.name,
            version=facts.version,
            settings=facts.settings,
            resolution=str(facts.resolution),
            until=run.case.until,
            every=run.case.every,
            where="a random scene, shrunk",
            boundary="accurate",
            failure=failure,
            silent=run.result.status is Status.DONE,
            truth=truth,
            scale=measured.scale,
            allowed=error / 2,
            note=reason,
        )
        path = folder / "program.py"
        write_text(path, element.failure_program(failed, source))
        return str(path)


def _engine_of(surprise: Surprise, engine: str) -> str:
    """Engine with the formulation of a surprise; or the truth."""
    name, _, formulation = surprise.kind.formulation.partition(" ")
    if name == TRUTH or not formulation:
        return name if name == TRUTH else engine
    spec = parse_engine(engine)
    return str(replace(spec, options={**spec.options, "formulation": formulation}))


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _text(tables: Mapping[str, Any]) -> str:
    return json.dumps(tables, sort_keys=True)


def _rows(tables: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Name and content of each table; the top level of the file has no name."""
    yield "", {key: value for key, value in tables.items() if not _is_table(value)}
    for table, content in tables.items():
        if isinstance(content, dict):
            yield table, content
        elif _is_table(content):
            for row in content:
                yield f"{table}.{row['name']}", row


def _difference(tables: Mapping[str, Any], rival: Mapping[str, Any]) -> str:
    """Clause on the difference of another scene, e.g. ``joints.joi1.v0 = 3 instead of -3``."""
    former = dict(_rows(tables))
    clauses = []
    for name, row in _rows(rival):
        for key, value in row.items():
            former_value = former.get(name, {}).get(key)
            if value != former_value:
                instead = f" instead of {_shown(former_value)}" if former_value is not None else ""
                clauses.append(f"{name}{'.' if name else ''}{key} = {_shown(value)}{instead}")
    return " and ".join(clauses)


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_shown, value))}]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _most_digits(tables: Mapping[str, Any]) -> int:
    """Most significant digits of the numbers of all tables, without numbers that were computed from others."""
    digits = [len(_significant(number)) for _, row in _rows(tables) for number in _numbers(list(row.values()))]
    return max([count for count in digits if count < _COMPUTED], default=1)


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, list):
        for part in value:
            yield from _numbers(part)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield float(value)


def _significant(number: float) -> str:
    """Significant digits of a number; an infinite one has none."""
    return "" if math.isinf(number) else repr(abs(number)).partition("e")[0].replace(".", "").strip("0")
