"""Answers of a report's first screen: a search of each engine in the scene of each comparison."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from proofroll.cli import options
from proofroll.core.errors import InputError, ProofrollError

if TYPE_CHECKING:
    from pathlib import Path

    from proofroll.core.comparison import Comparison
    from proofroll.report.page.growing import Report
    from proofroll.running.runner import Runner
    from proofroll.studies.answer.question import AnswerQuestion
    from proofroll.studies.answer.records import SceneAnswer
    from proofroll.studies.comparison.outcome import Outcome
    from proofroll.studies.judging.asked_tolerance import AskedTolerance

# Tolerances of the first screen where none is asked for; the first is seen first.
DEFAULTS = ("1e-4", "1e-2")


def search_answers(
    made: Report,
    outcomes: Sequence[Outcome],
    tolerances: Sequence[str],
    engines: Sequence[str],
    runner: Runner,
    out: Path,
    rest: Callable[[], float] | None,
    stage: str,
) -> None:
    """Adds the answers of all scenes to a report; of comparisons with one scene of one kind the first is asked about.

    Args:
        made: the report.
        outcomes: of the comparisons, whose first points are asked about.
        tolerances: texts of the option; empty: :data:`DEFAULTS`.
        engines: to which the report is restricted; empty: all.
        runner: runs the cases.
        out: folder of results.
        rest: processor time that is left of a budget [s]; None: there is no budget. Without any nothing is searched.
        stage: prefix of the bar's text.
    """
    from proofroll.report.answer.sentences import taken_sentence
    from proofroll.report.kinds import group_of
    from proofroll.report.page.first_screen import ReportedAnswer
    from proofroll.studies.judging.asked_tolerance import AskedTolerance

    seen: set[tuple[str, str]] = set()
    with options.progress_bar(f"{stage}scenes", total=len(outcomes)) as advance:
        for outcome in outcomes:
            advance(f"{stage}{outcome.comparison.name}")
            question = _question(outcome)
            if question is None or (rest and rest() <= 0):
                continue
            place = question.scene, group_of(question.loaded)
            if place in seen:
                continue
            seen.add(place)
            asked = []
            for text in tolerances or DEFAULTS:
                try:
                    asked.append(AskedTolerance.of([text], question.loaded))
                except InputError as error:
                    options.complain(f"{question.scene}: {error}")
            for answer in answers_of(question, asked, engines, runner, out):
                made.add_answer(
                    ReportedAnswer(
                        answer=answer, study=outcome.comparison.name, group=place[1], sentence=taken_sentence(answer)
                    )
                )
    made.write(out)


def require_tolerances(texts: Sequence[str], comparisons: Sequence[Comparison]) -> None:
    """Raises InputError for a tolerance that no scene of the comparisons takes."""
    from proofroll.files.scene_file import load_scene
    from proofroll.studies.judging.asked_tolerance import AskedTolerance

    errors: dict[str, list[InputError]] = {text: [] for text in texts}
    scenes = [load_scene(name) for name in dict.fromkeys(item.scene for item in comparisons)] if texts else []
    for text, scene in itertools.product(texts, scenes):
        try:
            AskedTolerance.of([text], scene)
        except InputError as error:
            errors[text].append(error)
    for problems in errors.values():
        if scenes and len(problems) == len(scenes):
            raise problems[0]


def _question(outcome: Outcome) -> AnswerQuestion | None:
    """Question about the first point of a comparison, over the scene's own duration; None: there is no truth."""
    from proofroll.studies.answer.question import AnswerQuestion, duration_of

    comparison = outcome.comparison
    point = next((item for item in outcome.points.values() if item.reference is not None), None)
    if point is None:
        return None
    until = duration_of(comparison.scene, comparison.until)
    return AnswerQuestion.of(comparison.scene, dict(point.case.parameters), until)


def answers_of(
    question: AnswerQuestion, asked: Sequence[AskedTolerance], engines: Sequence[str], runner: Runner, out: Path
) -> list[SceneAnswer]:
    """Stored answers of a scene, or new ones by a brief search.

    Without a truth there are none, with a line on standard error.
    """
    from proofroll.studies.answer.answers import answer, answer_path, kept, longest_stored
    from proofroll.studies.answer.setting_search import BRIEF

    paths = [answer_path(out, question, item, engines, BRIEF) for item in asked]
    answers = [None if runner.fresh else longest_stored(out, question, item, engines) for item in asked]
    missing = [item for item, earlier in zip(asked, answers, strict=True) if earlier is None]
    try:
        made = iter(answer(question, missing, engines, runner, caps=BRIEF) if missing else [])
    except ProofrollError as error:
        options.complain(f"{question.scene}: {error}")
        return [earlier for earlier in answers if earlier is not None]
    return [earlier or kept(next(made), path) for earlier, path in zip(answers, paths, strict=True)]
