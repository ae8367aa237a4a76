"""Answer of ``compare --engine … --tolerance …``: whether a person's own step is good enough."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from proofroll.cli import options

if TYPE_CHECKING:
    from proofroll.core.comparison import Comparison
    from proofroll.running.runner import Runner


def answer_steps(
    name: str,
    engines: Sequence[str],
    tolerances: Sequence[str],
    parameters: dict[str, Any],
    until: float | None,
    runner: Runner,
    out: Path,
    *,
    as_json: bool,
) -> NoReturn:
    """Prints a line for each engine, and exits: 1 if a step is not good enough.

    Args:
        name: of a scene or a comparison.
        engines: ``name[key=value,…]``.
        tolerances: texts of the option.
        parameters: values of the scene's parameters.
        until: length of the runs [s]; None: the scene's own duration.
        runner: runs the cases.
        out: folder of results.
        as_json: True for JSON.
    """
    from proofroll.files.json_data import plain
    from proofroll.report.answer.sentences import scope_sentence, step_sentence
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.studies.answer.answers import answer_path, stored
    from proofroll.studies.answer.by_name import question_named
    from proofroll.studies.answer.own_step import engine_facts, step_answer
    from proofroll.studies.answer.records import StepAnswer
    from proofroll.studies.judging.asked_tolerance import AskedTolerance
    from proofroll.studies.study_store import keep_study

    whole = question_named(name, parameters, until)
    asked = AskedTolerance.of(tolerances, whole.loaded)
    facts = [engine_facts(engine, whole, runner) for engine in engines]
    made = []
    for engine, pair in zip(engines, facts, strict=True):
        question = whole.sampled_for(pair[0].step)
        path = answer_path(out, question, asked, [f"step of {engine}"])
        answer = None if runner.fresh else stored(path, StepAnswer)
        if answer is None:
            with options.spinner(f"{engine} in {question.scene} over {question.until:g} s"):
                answer = step_answer(question, asked, engine, pair, runner)
            keep_study(answer, path)
        made.append(answer)
    if as_json:
        content = [{"sentence": step_sentence(item), **plain(item)} for item in made]
        options.write_json(content[0] if len(content) == 1 else content)
    else:
        heads = [f"{engine}: " if len(engines) > 1 else "" for engine in engines]
        lines = [f"{head}{step_sentence(item)}" for head, item in zip(heads, made, strict=True)]
        options.show_lines([*lines, scope_sentence(made[0])], widest=WIDTH)
    raise typer.Exit(options.OK if all(item.holds for item in made) else options.CONTRADICTED)


def stored_sentences(comparison: Comparison, out: Path) -> list[str]:
    """First sentence of a stored answer for the first point of a comparison at the default tolerance; else none."""
    from proofroll.files.scene_file import read_scene_file
    from proofroll.report.answer.sentences import taken_sentence
    from proofroll.studies.answer.answers import answer_path, stored
    from proofroll.studies.answer.question import AnswerQuestion
    from proofroll.studies.answer.records import SceneAnswer
    from proofroll.studies.judging.asked_tolerance import DEFAULT, AskedTolerance

    point = next(iter(comparison.combinations()), {})
    values = {name: value for name, value in point.items() if isinstance(value, float)}
    until = read_scene_file(comparison.scene).duration or comparison.until
    question = AnswerQuestion.of(comparison.scene, values, until)
    path = answer_path(out, question, AskedTolerance.of([DEFAULT], question.loaded))
    answer = stored(path, SceneAnswer) if path.is_file() else None
    return [f"To {DEFAULT} of the path: {taken_sentence(answer)}"] if answer is not None else []
