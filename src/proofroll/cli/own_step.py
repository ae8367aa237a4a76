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
    from proofroll.studies.answer.records import StepAnswer


def answer_steps(
    name: str,
    engines: Sequence[str],
    tolerances: Sequence[str],
    parameters: dict[str, Any],
    until: float | None,
    runner: Runner,
    out: Path,
    *,
    like: Path | None = None,
    as_json: bool,
) -> NoReturn:
    """Prints a line for each engine, and exits: 1 if a step is not good enough, 3 if that could not be decided.

    Args:
        name: of a scene or a comparison.
        engines: ``name[key=value,…]``.
        tolerances: texts of the option; empty: the default.
        parameters: values of the scene's parameters.
        until: length of the runs [s]; None: the scene's own duration.
        runner: runs the cases.
        out: folder of results.
        like: a person's own model, whose options are a further engine; None: there is none.
        as_json: True for JSON.
    """
    from proofroll.files.json_data import plain
    from proofroll.report.answer.sentences import scope_sentence, step_sentence
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.studies.answer.answers import answer_path, stored
    from proofroll.studies.answer.own_step import engine_facts, step_answer
    from proofroll.studies.answer.question import question_named
    from proofroll.studies.answer.records import StepAnswer
    from proofroll.studies.answer.setting_search import UNSEARCHED
    from proofroll.studies.comparison.default_comparison import own_engine
    from proofroll.studies.judging.asked_tolerance import DEFAULT, AskedTolerance
    from proofroll.studies.study_store import keep_study

    whole = question_named(name, parameters, until)
    asked = AskedTolerance.of(tolerances or [DEFAULT], whole.loaded)
    heads = [f"{engine}: " if len(engines) > 1 or like else "" for engine in engines]
    further: list[str] = []
    if like is not None:
        own_options, engine = own_engine(like, whole.loaded, runner.workers)
        heads.append(f"yours ({own_options.words}): ")
        engines = [*engines, engine]
        others = ", ".join(own_options.others)
        further = [f"Not compared, as the adapter has its own: {others}."] if others else []
    paths = {engine: answer_path(out, whole, asked, [engine], UNSEARCHED) for engine in engines}
    answers = {engine: None if runner.fresh else stored(path, StepAnswer) for engine, path in paths.items()}
    facts = {engine: engine_facts(engine, whole, runner) for engine, answer in answers.items() if answer is None}
    for engine, pair in facts.items():
        question = whole.sampled_for(pair[0].step)
        with options.spinner(f"{engine} in {question.scene} over {question.until:g} s"):
            answers[engine] = step_answer(question, asked, engine, pair, runner)
        keep_study(answers[engine], paths[engine])
    made = [answer for engine in engines if (answer := answers[engine]) is not None]
    if as_json:
        content = [{"sentence": step_sentence(item), "scope": scope_sentence(item), **plain(item)} for item in made]
        options.write_json(content[0] if len(content) == 1 else content)
    else:
        lines = [f"{head}{step_sentence(item)}" for head, item in zip(heads, made, strict=True)]
        lines += _change(made[-1]) if like else []
        options.show_lines([*lines, *further, scope_sentence(made[0])], widest=WIDTH)
    if all(item.holds for item in made):
        raise typer.Exit(options.OK)
    raise typer.Exit(options.ENGINE if all(item.holds or item.undecided for item in made) else options.CONTRADICTED)


def _change(made: StepAnswer) -> list[str]:
    """The line of a person's own model that makes a confirmed step, or the command that looks for other settings.

    Empty where theirs is good enough.
    """
    from proofroll.core.errors import ProofrollError
    from proofroll.core.plugins import parse_engine
    from proofroll.report.answer.sentences import lines_command
    from proofroll.report.page.model_lines import own_lines
    from proofroll.studies.answer.setting_search import State

    if made.holds or made.undecided:
        return []
    spec = parse_engine(made.advised.spec or made.spec)
    try:
        lines = own_lines(spec.name, spec.options) if made.advised.state is State.HOLDS else []
    except ProofrollError:
        lines = []
    changed = [f"Change this line: {line}" for line in lines if line.startswith("<option") or "numberOfSteps" in line]
    return changed or [f"Lines that do, if any: {lines_command(made, spec.name)}"]


def stored_sentences(comparison: Comparison, tolerances: Sequence[str], engines: Sequence[str], out: Path) -> list[str]:
    """First sentence of the stored answer of engines for the first point of a comparison and tolerances; else none."""
    from proofroll.report.answer.sentences import parameter_words, taken_sentence, tolerance_words
    from proofroll.studies.answer.answers import longest_stored
    from proofroll.studies.answer.question import AnswerQuestion, duration_of
    from proofroll.studies.judging.asked_tolerance import DEFAULT, AskedTolerance

    point = next(iter(comparison.combinations()), {})
    values = {name: value for name, value in point.items() if isinstance(value, float)}
    question = AnswerQuestion.of(comparison.scene, values, duration_of(comparison.scene, comparison.until))
    answer = longest_stored(out, question, AskedTolerance.of(tolerances or [DEFAULT], question.loaded), engines)
    if answer is None:
        return []
    return [f"To {', '.join([tolerance_words(answer), *parameter_words(answer)])}: {taken_sentence(answer)}"]
