"""Runs one random scene in an engine and the truth, and tells what should not be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from proofroll import InputError, Refused, load_scene
from proofroll.adapter import Scene
from proofroll.core.comparison import Band, Comparison, Row
from proofroll.core.plugins import parse_engine
from proofroll.core.verdict import Verdict
from proofroll.files.scene_file import SceneFile, read_scene_file
from proofroll.running.case import EngineFacts, Status
from proofroll.running.engine_questions import on_scene, resolve, resolve_with_truth
from proofroll.running.process import processor_seconds
from proofroll.running.runner import Runner
from proofroll.studies.cases import case_of
from proofroll.studies.comparison.compare import evaluate
from proofroll.studies.comparison.default_comparison import able, bounds
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.comparison.planning import Plan, plan, point_name
from proofroll_fuzz.drawing import Relation
from proofroll_fuzz.relations import breaches
from proofroll_fuzz.surprises import TRUTH, Surprise, failure_of_ours, surprises

_TIGHT = 1e-4  # part of its scale by which the limit of small steps of an observable may be off
_OF_STEPS, _OF_TOLERANCES = [2.0, 1.0, 0.5], [4.0, 2.0, 1.0]  # an engine may refuse a tighter tolerance
_NAME = "random"
_BECAUSE = "a random scene: limits of small steps are the same for all who solve it"


@dataclass(frozen=True)
class EvaluatedScene:
    """Result of a random scene in an engine and the truth.

    Attributes:
        invalid: message of the reader; empty: the scene is valid.
        fits: False if no formulation of the engine can represent the scene, which was not run then.
        truth: status of the truth; None: it was not run.
        surprises: the largest first.
        seconds: processor time [s].
    """

    invalid: str = ""
    fits: bool = True
    truth: Status | None = None
    surprises: tuple[Surprise, ...] = ()
    seconds: float = 0.0


def evaluate_scene(
    folder: Path,
    engine: str,
    runner: Runner,
    limit: float,
    relations: Mapping[str, Relation] = MappingProxyType({}),
    *,
    diagnosing: bool = True,
) -> EvaluatedScene:
    """Runs the scene in a folder in every able formulation of an engine at three steps, and in the truth.

    Args:
        folder: of the scene, whose file has ``duration``, ``dt`` and ``every``.
        engine: ``name`` or ``name[key=value,…]``; ``truth``: the truth alone.
        runner: of the cases.
        limit: wall time of one run [s].
        relations: name -> scene against which the truth is held.
        diagnosing: False leaves out causes of differences, which cost another truth.

    Raises:
        InputError: there is no such engine or setting.
    """
    begin = processor_seconds()
    try:
        outcome = outcome_of(folder, engine, runner, limit, diagnosing=diagnosing)
    except _Invalid as error:
        return EvaluatedScene(invalid=str(error), seconds=processor_seconds() - begin)
    except _Unable as error:
        shown = [failure_of_ours(str(error))]
        return EvaluatedScene(surprises=tuple(shown), seconds=processor_seconds() - begin)
    if outcome is None:
        return EvaluatedScene(fits=False, seconds=processor_seconds() - begin)
    (point,) = outcome.points.values()
    shown = surprises(outcome)
    for name, relation in relations.items():
        shown += breaches(folder, point, name, relation, runner)
    return EvaluatedScene(
        truth=point.result.status,
        surprises=tuple(sorted(shown, key=lambda item: -item.size)),
        seconds=processor_seconds() - begin,
    )


class _Invalid(Exception):  # noqa: N818 -- a fact about a scene
    """The reader refuses a scene."""


class _Unable(Exception):  # noqa: N818 -- a fact about a scene
    """The comparison fails on a scene that the reader takes."""


def outcome_of(folder: Path, engine: str, runner: Runner, limit: float, *, diagnosing: bool = False) -> Outcome | None:
    """Outcome of the comparison of a random scene, see :func:`evaluate_scene`; None: no formulation can represent it.

    Without a truth the engine is not run.
    """
    try:
        scene, file = load_scene(str(folder)), read_scene_file(str(folder))
    except (InputError, Refused) as error:
        raise _Invalid(str(error)) from None
    rows = _rows(engine, scene, file, runner)
    if not rows and engine != TRUTH:
        return None
    try:
        return _compared(_comparison(folder, scene, file, rows, limit), scene, file, runner, diagnosing=diagnosing)
    except InputError as error:
        raise _Unable(str(error)) from error


def _compared(comparison: Comparison, scene: Scene, file: SceneFile, runner: Runner, *, diagnosing: bool) -> Outcome:
    """Outcome of a comparison; its runs are not made without a truth."""
    rows = comparison.rows
    planned = plan(comparison, workers=runner.workers) if rows else _truth_alone(comparison, scene, file, runner)
    results = runner.run(planned.stages[0])
    (truth,) = results.values()
    if truth.status is not Status.DONE:
        return evaluate(replace(planned, runs=[]), results, runner)
    results |= runner.run(planned.cases)
    return evaluate(planned, results, runner, diagnosing=diagnosing)


def _truth_alone(comparison: Comparison, scene: Scene, file: SceneFile, runner: Runner) -> Plan:
    """Plan of a comparison without rows."""
    _, facts = resolve_with_truth([], runner.workers, scene.requires)
    case = case_of(
        comparison.scene,
        scene.fully_asked,
        (),
        on_scene(facts, scene, runner.workers),
        comparison.until,
        comparison.every,
        time_limit=comparison.time_limit,
    )
    name = point_name({})
    return Plan(comparison=comparison, scene=scene, file=file, scenes={name: scene}, truths={name: case}, runs=[])


def _rows(engine: str, scene: Scene, file: SceneFile, runner: Runner) -> list[Row]:
    """A row for each able formulation of an engine, at the scene's step and at its double and half."""
    if engine == TRUTH:
        return []
    spec = parse_engine(engine)
    texts = able(scene, runner.workers, names=[spec.name])
    if "formulation" in spec.options:
        texts = [text for text in texts if parse_engine(text).options["formulation"] == spec.options["formulation"]]
    specs = [replace(spec, options={**parse_engine(text).options, **spec.options}) for text in texts]
    rows = []
    facts = resolve([(item.name, item.options) for item in specs], runner.workers, scene.requires)
    for item, answer in zip(specs, facts, strict=True):
        if isinstance(answer, InputError):
            raise answer
        stepped = isinstance(answer, EngineFacts) and answer.step is not None and "dt" not in item.options
        row = replace(item, options={**item.options, "dt": f"{file.dt:.15g}"}) if stepped else item
        ladder = _OF_STEPS if stepped else _OF_TOLERANCES
        rows.append(Row(str(row), _NAME, list(Verdict), because=_BECAUSE, ladder=ladder))
    return rows


def _comparison(folder: Path, scene: Scene, file: SceneFile, rows: Sequence[Row], limit: float) -> Comparison:
    assert file.duration is not None  # every drawn scene has them
    assert file.every is not None
    tolerances = {
        name: replace(item, value=_TIGHT) if item.relative else item for name, item in bounds(scene, file.every).items()
    }
    return Comparison(
        name=folder.name,
        title=file.title,
        question="",
        scene=str(folder),
        until=file.duration,
        every=file.every,
        bands={_NAME: Band(_BECAUSE, tolerances)},
        rows=[*rows],
        time_limit=limit,
        timed=False,
    )
