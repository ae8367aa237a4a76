"""Command ``recommend``: the cheapest setting of each engine that holds a tolerance, found by a search."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError, ProofrollError

if TYPE_CHECKING:
    from proofroll.running.runner import Runner
    from proofroll.studies.answer.question import AnswerQuestion
    from proofroll.studies.answer.records import EngineAnswer, SceneAnswer
    from proofroll.studies.judging.asked_tolerance import AskedTolerance


def recommend(
    scenes: Annotated[
        list[str],
        typer.Argument(
            help="A scene, a robot file, or a comparison; several.",
            autocompletion=options.compared_like,
            callback=options.own_first,
        ),
    ],
    tolerance: options.Tolerances = None,
    settings: options.Set = None,
    _root: options.Root = None,
    control: options.Control = None,
    ground: options.Ground = None,
    engine: Annotated[
        list[str] | None,
        typer.Option(
            help="Choose among these engines, name[key=value,…]; repeat.", autocompletion=options.engines_like
        ),
    ] = None,
    until: options.Until = None,
    forces: Annotated[bool, typer.Option("--forces", help="Forces count as the motion does.")] = False,
    lines: Annotated[
        bool, typer.Option("--lines", help="Print only the lines that make the choice in a model of your own.")
    ] = False,
    plot: Annotated[
        Path | None, typer.Option(help="Draw error against cost of all runs of the search into this file, *.svg.")
    ] = None,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    as_json: options.Json = False,
) -> None:
    """Name the cheapest engine and step that holds a tolerance. It is held over the scene's own duration.

    Each engine is searched over all its settings and steps until no other can be cheaper. A step is advised if half of
    it holds, too, and a third more does not break down. A run takes about 8 s of processor time at most, an engine 30;
    what that leaves open is named. Exit 1 if nothing holds the tolerance, 3 if no engine could be tried.
    """
    options.begin_workers()
    from proofroll.files.json_data import plain
    from proofroll.report.answer.sentences import answer_lines, scope_sentence, taken_sentence
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.running.idle_workers import Workers
    from proofroll.studies.answer.question import question_named
    from proofroll.studies.judging.asked_tolerance import DEFAULT, AskedTolerance

    if plot is not None:
        _require_drawable(plot, scenes)
    settings = options.with_ground(settings, control, ground)
    scenes = [options.controlled(scene, control) for scene in scenes]
    questions = [question_named(scene, options.assignments(settings), until) for scene in scenes]
    questions = [item.sampled_for(_given_step(engine or [])) for item in questions]
    asked = [AskedTolerance.of(tolerance or [DEFAULT], item.loaded, forces=forces) for item in questions]
    runner = options.new_runner(out, fresh, jobs, workers=Workers())
    made = []
    for question, of_scene in zip(questions, asked, strict=True):
        made.append(_answer(question, of_scene, engine or [], runner, out, quiet=as_json or lines))
        if not as_json and not lines:
            head = [question.scene] if len(questions) > 1 else []
            options.show_lines([*head, *answer_lines(made[-1])], widest=WIDTH)
    if plot is not None:
        _draw(made[0], plot)
    if as_json:
        content = [{"sentence": taken_sentence(item), "scope": scope_sentence(item), **plain(item)} for item in made]
        options.write_json(content[0] if len(content) == 1 else content)
    elif lines:
        _print_lines(made)
    without = [item for item in made if not item.taken]
    raise typer.Exit(
        options.ENGINE if any(item.untried for item in without) else options.CONTRADICTED if without else options.OK
    )


def _require_drawable(path: Path, scenes: list[str]) -> None:
    """Raises InputError for a picture of several scenes, or one that is no SVG or cannot be written."""
    if len(scenes) > 1:
        raise InputError("--plot", path, "a picture is of one scene")
    if path.suffix != ".svg":
        raise InputError("--plot", path, "name a file *.svg")
    options.require_writable(path, "--plot")


def _draw(made: SceneAnswer, path: Path) -> None:
    """Writes error against cost of all runs of a search.

    Raises:
        ProofrollError: no run reached its end.
    """
    from proofroll.report.answer.picture import svg
    from proofroll.running.store import write_text

    drawn = svg(made, alone=True)
    if not drawn:
        raise ProofrollError("--plot: no run reached its end, so there is nothing to draw")
    write_text(path, drawn)


def _given_step(engines: list[str]) -> float | None:
    """Longest step that engines are given in brackets [s]; None: they are given none that is a number."""
    from proofroll.core.plugins import parse_engine

    steps = []
    for text in engines:
        with suppress(ValueError):  # the engine says what is wrong
            steps.append(float(parse_engine(text).options.get("dt", "")))
    return max(steps, default=None)


def _answer(
    question: AnswerQuestion, asked: AskedTolerance, engines: list[str], runner: Runner, out: Path, *, quiet: bool
) -> SceneAnswer:
    """Stored answer, or a new one, whose parts are printed on standard error as they are found."""
    from proofroll.report.answer.sentences import sentence
    from proofroll.studies.answer.answers import answer, answer_path, kept, longest_stored
    from proofroll.studies.answer.setting_search import WHOLE

    if not runner.fresh and (earlier := longest_stored(out, question, asked, engines, whole=True)) is not None:
        return earlier

    def begin(names: Sequence[str]) -> None:
        if not quiet:
            place = f"{question.scene} over {question.until:g} s"
            options.complain(
                f"searching {', '.join(names)} in {place}: about {WHOLE.engine:g} s of processor time each at most"
            )

    def tell(item: EngineAnswer, until: float) -> None:
        if not quiet:
            options.complain(sentence(item, until))

    with options.progress_bar(f"{question.scene}: the truth") as advance:
        (made,) = answer(question, [asked], engines, runner, begin, tell, lambda engine: advance(f"runs of {engine}"))
    return kept(made, answer_path(out, question, asked, engines))


def _print_lines(made: list[SceneAnswer]) -> None:
    """Prints the lines of an engine's own file or program that make the setting to take, unbroken.

    Raises:
        ProofrollError: nothing holds the tolerance, or the engine's adapter tells no lines.
    """
    from proofroll.core.plugins import parse_engine
    from proofroll.report.page.model_lines import own_lines

    for item in made:
        if item.taken is None:
            raise ProofrollError("--lines: no engine is shown to hold the tolerance; without it the nearest is told")
        spec = parse_engine(item.taken.spec)
        try:
            typer.echo("\n".join(own_lines(spec.name, spec.options)))
        except ProofrollError as error:
            raise ProofrollError(f"--lines: {spec.name}: {error}") from error
