"""Runs the same comparisons in two versions of one engine."""

import dataclasses
from collections.abc import Callable, Sequence

from proofroll.core.comparison import Comparison, Row
from proofroll.core.errors import InputError
from proofroll.core.plugins import parse_engine
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.files.data_folders import study_folders
from proofroll.files.scene_file import is_scene
from proofroll.files.toml import study_of
from proofroll.running.runner import Runner
from proofroll.studies.comparison.compare import evaluate, run_plans
from proofroll.studies.comparison.default_comparison import default_comparison
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.comparison.planning import plan


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
    choices = [item for subject in dict.fromkeys(subjects) for item in _about(subject, engine)]
    return [item for place, item in enumerate(choices) if item not in choices[:place]]


def _about(subject: str, engine: str) -> list[Comparison]:
    """The comparison of a name, or those about a scene, that have rows of the engine. Raises InputError."""
    if not is_scene(subject):
        comparison = load_comparison(subject)
        if not _rows_of(comparison, engine):
            raise InputError("engine", engine, f"{comparison.name} has no rows of it")
        return [comparison]
    files = [path for folder in study_folders() for path in sorted(folder.rglob("*.toml")) if study_of(path) is None]
    picks = [item for path in files if (item := load_comparison(str(path))).scene == subject and _rows_of(item, engine)]
    return picks or [_of_scene(subject, engine)]


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


def outcomes_of_versions(
    sides: tuple[str, str], comparisons: Sequence[Comparison], runner: Runner, progress: Callable[[str], None]
) -> tuple[list[Outcome], list[Outcome]]:
    """Outcomes of the same comparisons in two versions of an engine, ``NAME`` or ``NAME@PLACE`` each.

    ``progress`` is called with the engine of each case that has ended.
    """
    asked = [plan(item, [side], runner.workers) for side in sides for item in comparisons]
    plans, results = run_plans(asked, runner, lambda case, _: progress(case.engine.name))
    outcomes = [evaluate(item, results, runner) for item in plans]
    return outcomes[: len(comparisons)], outcomes[len(comparisons) :]
