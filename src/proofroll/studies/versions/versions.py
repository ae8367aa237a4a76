"""Runs the same cases in two versions of one engine, and summarises the differences."""

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from proofroll.core.comparison import Comparison, Row
from proofroll.core.errors import InputError
from proofroll.core.plugins import parse_engine, plain_name
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.files.data_folders import study_folders
from proofroll.files.scene_file import is_scene
from proofroll.files.toml import study_of
from proofroll.running.case import EngineDescription, Status, hosts
from proofroll.running.engine_questions import describe
from proofroll.running.runner import Runner
from proofroll.running.stopwatch import Stopwatch
from proofroll.running.timing import Interval, ratio, time_in_rounds
from proofroll.studies.comparison.compare import evaluate
from proofroll.studies.comparison.default_comparison import default_comparison
from proofroll.studies.comparison.outcome import Outcome, Run
from proofroll.studies.comparison.planning import plan
from proofroll.studies.versions.difference import (
    CaseDifference,
    NumberKind,
    NumbersApart,
    OrderChange,
    case_difference,
    setting_of,
)


def comparisons_about(subjects: Sequence[str], engine: str) -> list[Comparison]:
    """Comparisons to run: the named ones, those about scenes, or all that have rows of the engine.

    Args:
        subjects: names or paths of comparisons or scenes; none: all comparisons, each reduced to its brief part.
        engine: plain name; for a scene without comparisons, all its formulations are run.

    Raises:
        InputError: there is no such comparison or scene, or it has no rows of this engine.
    """
    if not subjects:
        comparisons = [load_comparison(name).briefly() for name in comparison_names()]
        comparisons = [item for item in comparisons if _rows_of(item, engine)]
        if not comparisons:
            raise InputError("engine", engine, "no comparison has rows of it; name a scene or a comparison")
        return comparisons
    named = [item for subject in dict.fromkeys(subjects) for item in _about(subject, engine)]
    return [item for place, item in enumerate(named) if item not in named[:place]]


def _about(subject: str, engine: str) -> list[Comparison]:
    """The comparison of a name, or those about a scene, that have rows of the engine. Raises InputError."""
    if not is_scene(subject):
        loaded = load_comparison(subject)
        if not _rows_of(loaded, engine):
            raise InputError("engine", engine, f"{loaded.name} has no rows of it")
        return [loaded]
    files = [path for folder in study_folders() for path in sorted(folder.rglob("*.toml")) if study_of(path) is None]
    about = [item for path in files if (item := load_comparison(str(path))).scene == subject and _rows_of(item, engine)]
    return about or [_of_scene(subject, engine)]


def _rows_of(comparison: Comparison, engine: str) -> list[Row]:
    return [row for row in comparison.rows if parse_engine(row.engine).name == engine]


def _of_scene(name: str, engine: str) -> Comparison:
    """Rows of one engine in the default comparison of a scene."""
    comparison = default_comparison(name, {})
    rows = _rows_of(comparison, engine)
    if not rows:
        why = f"no comparison about {name} has rows of it, and no formulation of it that is installed here can"
        raise InputError("engine", engine, why)
    return dataclasses.replace(comparison, rows=rows, timed=False)


Progress = Callable[[str], None]


@dataclass(frozen=True)
class SettingDifference:
    """All points of a setting in both versions.

    Attributes:
        comparison, setting: names of the row.
        cases: number of points.
        verdicts: ``old`` and ``new`` -> verdict -> number of cases.
        numbers: of the case with the largest difference.
        declared_order: ``old`` and ``new`` -> declared orders of its points, without repetition.
        orders: observed orders that changed, of all cases.
        changed: number of cases with a changed verdict.
        speed: time of the new version over that of the old one, or None.
    """

    comparison: str
    setting: str
    cases: int
    verdicts: dict[str, dict[str, int]]
    numbers: NumbersApart | None
    declared_order: dict[str, list[int]]
    orders: list[OrderChange]
    changed: int
    speed: Interval | None


@dataclass(frozen=True)
class EngineVersion:
    """One of the versions: the engine as ``--engine`` takes it, its version, and the path of its Python."""

    name: str
    version: str
    interpreter: str


@dataclass(frozen=True)
class ChangedDefault:
    """Default value or capability that changed; None: it does not exist in that version."""

    name: str
    old: Any
    new: Any


@dataclass(frozen=True, kw_only=True)
class VersionsStudy:
    """One engine in two versions.

    Attributes:
        engine: its name.
        old, new: the versions.
        comparisons: names of the comparisons that were run.
        rows: differences by comparison and setting.
        cases: differences by case.
        defaults: changed default values and capabilities.
        hosts: machine of a cluster -> number of results that it made.
        changed: sentences about verdicts that changed.
        lost: sentences about runs whose engine is missing.
    """

    engine: str
    old: EngineVersion
    new: EngineVersion
    comparisons: list[str]
    rows: list[SettingDifference] = field(default_factory=list)
    cases: list[CaseDifference] = field(default_factory=list)
    defaults: list[ChangedDefault] = field(default_factory=list)
    hosts: dict[str, int] = field(default_factory=dict)
    changed: list[str]
    lost: list[str]


def compare_versions(
    sides: tuple[str, str],
    comparisons: Sequence[Comparison],
    runner: Runner,
    rounds: int,
    progress: Progress | None = None,
) -> VersionsStudy:
    """Differences between two versions of an engine on the same cases.

    Args:
        sides: the versions, ``NAME`` or ``NAME@PLACE``.
        comparisons: to be run with both.
        runner: runs the cases.
        rounds: of the timing; 0: speeds are not measured.
        progress: called with a text after each step.

    Raises:
        InputError, Missing, WorkerDied: a version cannot be asked.
    """
    progress = progress or (lambda _: None)
    descriptions = [describe(side, runner.workers) for side in sides]
    plans = [plan(dataclasses.replace(item, timed=False), sides, runner.workers) for item in comparisons]
    cases = {case.key: case for item in plans for case in item.cases}
    results = runner.run(cases.values(), lambda case, _: progress(case.engine.name))
    pairs: list[tuple[Outcome, Run, Run]] = []
    for item in plans:
        outcome = evaluate(item, results, runner)
        old_runs, new_runs = (
            [run for run in outcome.runs if parse_engine(run.row.engine).name == side] for side in sides
        )
        pairs += [(outcome, old_run, new_run) for old_run, new_run in zip(old_runs, new_runs, strict=True)]
    differences = [case_difference(outcome, old_run, new_run) for outcome, old_run, new_run in pairs]
    speeds = _speeds(pairs, runner, rounds, progress) if rounds else {}
    old, new = (
        EngineVersion(name, item.version, item.interpreter) for name, item in zip(sides, descriptions, strict=True)
    )
    return VersionsStudy(
        engine=plain_name(parse_engine(sides[0]).name),
        old=old,
        new=new,
        comparisons=[item.name for item in comparisons],
        rows=_rows(differences, speeds),
        cases=differences,
        defaults=_defaults(*descriptions),
        hosts=hosts(run.result for _, *pair in pairs for run in pair),
        changed=[f"{_where(case)}: {what}" for case in differences for what in case.changed],
        lost=[
            f"{name} {_where(case)}: {side.message}"
            for case in differences
            for name, side in (("old", case.old), ("new", case.new))
            if side.status == Status.MISSING
        ],
    )


def _where(case: CaseDifference) -> str:
    return f"{case.comparison}: {case.setting}" + (f" at {case.point}" if case.point else "")


def _rows(cases: Sequence[CaseDifference], speeds: Mapping[tuple[str, str], Interval]) -> list[SettingDifference]:
    """Summary of all points of each setting."""
    grouped: dict[tuple[str, str], list[CaseDifference]] = {}
    for case in cases:
        grouped.setdefault((case.comparison, case.setting), []).append(case)
    return [
        SettingDifference(
            comparison=key[0],
            setting=key[1],
            cases=len(group),
            verdicts={
                "old": dict(Counter(str(case.old.verdict) for case in group)),
                "new": dict(Counter(str(case.new.verdict) for case in group)),
            },
            numbers=max(
                (case.numbers for case in group if case.numbers is not None),
                key=lambda item: (item.relative, item.kind != NumberKind.SAME_BITS),
                default=None,
            ),
            declared_order={
                "old": sorted({order for case in group if (order := case.old.declared_order)}),
                "new": sorted({order for case in group if (order := case.new.declared_order)}),
            },
            orders=[order for case in group for order in case.orders],
            changed=sum(bool(case.changed) for case in group),
            speed=speeds.get(key),
        )
        for key, group in grouped.items()
    ]


def _speeds(
    pairs: Sequence[tuple[Outcome, Run, Run]], runner: Runner, rounds: int, progress: Progress
) -> dict[tuple[str, str], Interval]:
    """Time of the new version over that of the old one, at the first point of each setting that both ran."""
    chosen: dict[tuple[str, str], tuple[Run, Run]] = {}
    for outcome, old, new in pairs:
        if old.result.status == new.result.status == Status.DONE:
            chosen.setdefault((outcome.comparison.name, setting_of(old)), (old, new))
    speeds = {}
    with Stopwatch(runner.workers) as watch:
        for key, (old, new) in chosen.items():
            assert old.case is not None  # both ran
            assert new.case is not None
            timings = time_in_rounds({"old": partial(watch, old.case), "new": partial(watch, new.case)}, rounds)
            progress(f"timing {key[1]}")
            if timings.keys() == {"old", "new"} and len(timings["old"].values) == len(timings["new"].values):
                speeds[key] = ratio(timings["new"], timings["old"])
    return speeds


def _defaults(old: EngineDescription, new: EngineDescription) -> list[ChangedDefault]:
    """Default values and capabilities that differ between two versions."""
    both: tuple[tuple[dict[str, Any], dict[str, Any]], ...] = (
        (old.defaults, new.defaults),
        (old.provides, new.provides),
    )
    return [
        ChangedDefault(name, old_values.get(name), new_values.get(name))
        for old_values, new_values in both
        for name in sorted(old_values.keys() | new_values.keys())
        if old_values.get(name) != new_values.get(name)
    ]
