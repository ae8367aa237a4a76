"""Command ``recommend``: the cheapest choice that holds a tolerance, from measured curves."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from proofroll.cli import options
from proofroll.cli.tradeoff import Over, measure, question_of, ranges_of, require_observables
from proofroll.core.errors import InputError, ProofrollError, require_known
from proofroll.core.number_format import number

if TYPE_CHECKING:
    from proofroll.core.comparison import Tolerance
    from proofroll.report.changes import EarlierReport
    from proofroll.report.long_table import TableLine
    from proofroll.report.page.choice_matrix import ChoiceMatrix
    from proofroll.studies.tradeoff.claims import TradeoffClaims
    from proofroll.studies.tradeoff.curve import Question
    from proofroll.studies.tradeoff.records import TradeoffStudy

_NOTHING = "nothing that was measured holds the tolerance; without --lines the closest is told"
# A part of the path, as the first screen of a report has it.
_OF_PATH = re.compile(r"\s*(\d+\.?\d*(?:[eE][-+]?\d+)?)\s*of\s+(?:the\s+)?path\s*")


def recommend(
    scenes: Annotated[
        list[str], typer.Argument(help="A scene, or a file of a trade-off; several scenes, studies or groups.")
    ],
    quantity: Annotated[str, typer.Option(help="Observable that matters.")] = "",
    tolerance: Annotated[
        str, typer.Option(help="Largest error: 1e-3 in its unit, '1 mm', '1 %' or '1e-4 of path' of its size.")
    ] = "",
    max_cost: Annotated[
        float | None, typer.Option(help="Wall seconds per simulated second that a run may take.")
    ] = None,
    budget: Annotated[float | None, typer.Option(hidden=True)] = None,
    settings: options.Set = None,
    control: options.Control = None,
    engine: Annotated[
        list[str] | None, typer.Option(help="Choose among these engines, name[key=value,…]; repeat.")
    ] = None,
    over: Over = None,
    until: options.Until = None,
    measure_first: Annotated[
        bool, typer.Option("--measure", help="Measure first if no curves are stored, as tradeoff without --budget.")
    ] = False,
    lines: Annotated[
        bool,
        typer.Option("--lines", help="Print only the lines that make the choice in a model of your own."),
    ] = False,
    forces: Annotated[bool, typer.Option("--forces", help="Forces count as the motion does; from a report.")] = False,
    every_setting: Annotated[
        bool, typer.Option("--scenes", help="Of several scenes list all formulations of each; from a report.")
    ] = False,
    report: Annotated[
        Path | None, typer.Option(help="A report.json whose runs answer, as they do for several names.")
    ] = None,
    out: options.Out = Path("out"),
    jobs: options.Jobs = None,
    as_json: options.Json = False,
) -> None:
    """Name the cheapest engine, formulation and step that holds a tolerance here, and why.

    It chooses among models of engines; solutions of the scene's own equations (closed form, reduced, projection) are
    listed apart, unless --engine asks for them. Of the cheaper ones, which all fail, the most accurate is shown.

    A group (as loops), several scenes or studies, and a scene in the report are answered from the report's runs
    (OUT/report.json, or --report): a choice for each, one over all, and the cost of every engine. The default tolerance
    is 1e-4 of the path, as on the first screen. Another scene is answered from measured curves. If --forces asks for
    forces that are not judged, the choice is for motion alone.
    """
    if budget is not None:
        raise InputError("--budget", budget, "here it is --max-cost; elsewhere a budget is processor time")
    if control is not None:
        scenes = [options.controlled(scene, control) for scene in scenes]
    report_file = out / "report.json"
    requirements = {
        "--quantity": quantity,
        "--max-cost": max_cost,
        "--set": settings,
        "--over": over,
        "--until": until,
        "--measure": measure_first,
    }
    asked = len(scenes) > 1 or forces or report is not None
    if asked or (not any(requirements.values()) and _is_in_report(scenes[0], report_file)):
        for name, value in requirements.items():
            if value:
                raise InputError(name, value if value is not True else "given", "it is for one scene, without a report")
        from proofroll.report.changes import EarlierReport

        stored = EarlierReport.read(report or report_file, "--report" if report else "stored report")
        _from_report(
            scenes,
            tolerance,
            engine or [],
            stored,
            forces=forces,
            every_setting=every_setting,
            lines_alone=lines and not as_json,
            as_json=as_json,
        )
    (scene,) = scenes
    _require_no_kind(scene, report_file)
    from proofroll.core.plugins import engine_names, parse_engine, require_engine
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.report.tradeoff.tables import answer_lines
    from proofroll.studies.tradeoff.recommend import recommend as answered
    from proofroll.studies.tradeoff.requirements import Requirements

    claims, question = question_of(scene, settings, [quantity] if quantity else None, until)
    require_observables(question, [question.quantity])  # before minutes are spent on measuring
    for text in engine or []:
        require_engine(parse_engine(text).name)
    unit = question.loaded.observables[question.quantity].unit
    required = Requirements(question.quantity, _tolerance(tolerance, unit), _seconds(max_cost), tuple(engine or ()))
    ranges = ranges_of(question, over) if over is not None else None
    study = _stored_study(question, engine or [], claims, ranges, out, jobs, measure_first=measure_first)
    names = {*study.absent, *(point.engine for point in study.points)}
    not_measured = [] if engine else [name for name in engine_names() if name not in names]
    omitted = list(question.loaded.omitted) or None
    recommendation = replace(answered(study, required), not_measured=not_measured, omitted=omitted)
    if lines and not as_json:
        choice = recommendation.answer.choice
        if choice is None:
            raise ProofrollError(f"--lines: {_NOTHING}")
        _print_lines(
            choice.point.engine, {key: value for key, value in choice.point.settings.items() if value is not None}
        )
    else:
        options.show(recommendation, as_json, lambda: answer_lines(recommendation), widest=WIDTH)
    raise typer.Exit(options.OK if recommendation.answer.choice and recommendation.affordable else options.CONTRADICTED)


def _print_lines(name: str, settings: Mapping[str, Any]) -> None:
    """Prints the lines of an engine's own file or program that make settings, unbroken, as a program reads them.

    Raises:
        ProofrollError: the engine's adapter tells no lines.
    """
    from proofroll.report.page.model_lines import own_lines

    try:
        typer.echo("\n".join(own_lines(name, settings)))
    except ProofrollError as error:
        raise ProofrollError(f"--lines: {name}: {error}") from error


def _spec_of_one(matrix: ChoiceMatrix, tolerance: float, *, forces: bool) -> str:
    """Setting to take, as a command has it, in the one scene of a matrix.

    Raises:
        InputError: there are several scenes.
        ProofrollError: nothing holds the tolerance.
    """
    from proofroll.report.page.answer import answer

    single = [item for item in answer(matrix, tolerance, forces).columns if not item.column.whole]
    if len(single) != 1:
        names = ", ".join(item.column.name for item in single)
        raise InputError("--lines", "given", f"it is for one scene; name one of {names}")
    taken = single[0].taken
    if taken is None or taken.run is None:
        raise ProofrollError(f"--lines: {_NOTHING}")
    return taken.run.spec


def _require_no_kind(name: str, path: Path) -> None:
    """Raises InputError for a kind of scenes or several names in one, which only a report answers."""
    from proofroll.files.scene_file import is_scene, scene_names
    from proofroll.report.kinds import group_of
    from proofroll.studies.cases import scene_of_run

    if is_scene(name) or name.endswith(".toml"):
        return
    kinds = {group_of(scene_of_run(scene, {}, ())) for scene in scene_names()} if name.isidentifier() else set()
    if "," in name or any(name in {kind, *kind.split()} for kind in kinds):
        studies = name.replace(",", " ") if "," in name else f"--only {name}"
        advice = f"kinds and several scenes are answered from {path}, which is not there; proofroll report {studies}"
        raise InputError("scenes", name, f"{advice} makes it")


def _is_in_report(name: str, path: Path) -> bool:
    """True if a report has runs of a scene; a name that is no scene is always looked for there."""
    from proofroll.files.scene_file import is_scene
    from proofroll.report.changes import EarlierReport

    if not path.is_file() or name.endswith(".toml"):
        return False
    return not is_scene(name) or any(line.scene == name for line in EarlierReport.read(path, "stored report").lines)


def _from_report(
    names: list[str],
    tolerance: str,
    engines: list[str],
    report: EarlierReport,
    *,
    forces: bool,
    every_setting: bool,
    lines_alone: bool,
    as_json: bool,
) -> NoReturn:
    """Prints advice for several scenes from a report's runs, and exits: 1 if in one nothing holds the tolerance."""
    from proofroll.core.comparison import Tolerance
    from proofroll.files.scene_file import is_scene
    from proofroll.files.toml import named_file
    from proofroll.report.page.advice import advice
    from proofroll.report.page.choice_matrix import FIRST_TOLERANCE, ChoiceStudy, choice_matrix
    from proofroll.report.terminal.answers import advice_lines, answers
    from proofroll.report.terminal.screen import WIDTH

    path, lines = report.path, report.lines
    for name in engines:
        require_known("--engine", name, sorted({line.engine for line in lines}), f"{path} has")
    lines = [line for line in lines if not engines or line.engine in engines]
    studies: dict[str, ChoiceStudy] = {}
    for name in [name for text in names for name in text.split(",")]:
        of_name = [line for line in lines if name in {line.study, line.scene, line.group, *line.group.split()}]
        if not of_name:
            groups = ", ".join(dict.fromkeys(line.group for line in lines))
            lacking = f"has no such scene, comparison or group; the groups there are {groups}"
            if is_scene(name) or named_file(name):
                lacking = f"has no runs of it; proofroll report {name} makes them"
            raise InputError("scenes", name, f"{path} {lacking}")
        studies |= {line.study: ChoiceStudy(line.study, "") for line in of_name}
    lines = [line for line in lines if line.study in studies]
    unit = _unit_of(lines)
    bound = _tolerance(tolerance, unit, bare_is_part=forces) if tolerance else Tolerance(FIRST_TOLERANCE, True)
    if not bound.relative:
        if forces:
            advice_of_parts = "motion and forces have different units; give a part, as '0.01 %' or '1e-4 of path'"
            raise InputError("tolerance", tolerance, advice_of_parts)
        # in the unit of the motion: a quantity whose scale is one unit has that error as its part
        lines = [replace(line, scale=1.0) for line in lines if line.unit == unit or not line.quantity]
    part = bound.value
    matrix = choice_matrix(lines, studies, report.names)
    if lines_alone:
        from proofroll.core.plugins import parse_engine

        setting = parse_engine(_spec_of_one(matrix, part, forces=forces))
        _print_lines(setting.name, setting.options)
        raise typer.Exit(options.OK)
    advised = advice(matrix, part, forces)
    costs = _engine_costs(matrix, part, forces=forces)
    durations = {line.scene: line.until for line in reversed(lines)}
    content = {
        "report": str(path),
        "tolerance": part,
        "unit": "part of the path" if bound.relative else unit,
        "with_forces": forces,
        "shown_over": durations,
        "advice": advised,
        "engines": costs,
    }
    arguments = answers(matrix, part, forces), advised[-1].sentence, costs, durations
    words = f"{number(part)} {'of the path' if bound.relative else unit}"
    parts = partial(advice_lines, *arguments, words, forces=forces, every_setting=every_setting)
    options.show(content, as_json, parts, widest=WIDTH)
    single = [item for item, column in zip(advised, matrix.columns, strict=False) if not column.whole]
    chosen = [bool(item.choice) for item in single if item.judged]
    raise typer.Exit(options.OK if chosen and all(chosen) else options.CONTRADICTED)


def _unit_of(lines: Iterable[TableLine]) -> str:
    """Unit of the motion that summaries show; of several units the most frequent."""
    units = [line.unit for line in lines if line.role == "motion" and line.headline and line.unit]
    return max(sorted(set(units)), key=units.count, default="m")


def _engine_costs(matrix: ChoiceMatrix, tolerance: float, *, forces: bool) -> list[dict[str, Any]]:
    """Every formulation in each group or scene: whether it holds the tolerance, its cost [s/s], setting, or why not."""
    from proofroll.report.page.choice_cell import CANNOT, NO_RUN

    costs = []
    columns = {column.studies: column for column in reversed(matrix.columns)}  # a group of one study is told once
    for column in reversed(columns.values()):
        for row in matrix.rows:
            if row.setting:
                continue
            cell = matrix.cell(row, column, tolerance, forces)
            if cell.state in {NO_RUN, CANNOT}:
                continue
            held = math.isfinite(cell.cost)
            setting = cell.name.removeprefix(row.name).strip()
            answer = {"of": column.name, "engine": row.name, "holds": held, "state": cell.state, "setting": setting}
            costs.append(answer | {"cost": cell.cost if held else None, "text": cell.text if held else cell.why})
    return costs


def _tolerance(text: str, unit: str, *, bare_is_part: bool = False) -> Tolerance:
    """Tolerance of the option; ``bare_is_part``: a number without a unit is a part of the path.

    Raises:
        InputError: the tolerance has another form or unit.
        ProofrollError: no tolerance is asked for.
    """
    from proofroll.core.comparison import Tolerance

    if not text:
        words = "give the largest error that you can bear, e.g. --tolerance 1e-3, or --tolerance '1 %' of the scale"
        raise ProofrollError(f"--tolerance is missing: {words}")
    part = _OF_PATH.fullmatch(text) or (_OF_PATH.fullmatch(f"{text} of path") if bare_is_part else None)
    return Tolerance.of_quantity("tolerance", f"{100 * float(part[1]):.17g} %" if part else text, unit)


def _seconds(max_cost: float | None) -> float | None:
    if max_cost is not None and not 0 < max_cost < float("inf"):
        raise InputError("--max-cost", max_cost, "give a positive number of seconds")
    return max_cost


def _stored_study(
    question: Question,
    engines: list[str],
    claims: TradeoffClaims | None,
    ranges: dict[str, list[float]] | None,
    out: Path,
    jobs: int | None,
    *,
    measure_first: bool,
) -> TradeoffStudy:
    """Stored curves that contain the engines asked for, or new ones if the user agrees.

    With ``ranges`` of parameters they must have been checked over these. Raises InputError if there are none.
    """
    from proofroll.studies.study_store import valid_study
    from proofroll.studies.tradeoff.recommend import covers
    from proofroll.studies.tradeoff.records import TradeoffStudy
    from proofroll.studies.tradeoff.tradeoff import Extent, restricted_paths, study_path

    reasons: list[str] = []
    for path in (
        study_path(out, question),
        *restricted_paths(out, question),
        study_path(out, question, brief=True),
    ):
        study, changes = valid_study(path, TradeoffStudy)
        if study is not None and not covers(study.engines, engines):
            changes = [f"the stored curves are of {', '.join(study.engines)}; choose among these with --engine"]
            study = None
        if study is not None and ranges is not None and study.over != ranges:
            study, changes = None, ["the stored curves were not checked over these ranges"]
        if study is not None:
            return study
        reasons = changes or reasons
    reasons = reasons or ["no curves are stored for this question"]
    why = "; ".join(reasons[:3]) + (f"; and {len(reasons) - 3} more" if len(reasons) > 3 else "")
    if not measure_first and sys.stdin.isatty() and sys.stderr.isatty():
        measure_first = typer.confirm(f"{why}. Measure now (some minutes)?", err=True)
    if not measure_first:
        advice = f"{why}; add --measure, which takes some minutes, or run proofroll tradeoff first"
        raise InputError("stored study", None, advice)
    over = ranges if ranges is not None else (claims.over if claims else {})
    return measure(question, Extent(engines, over), claims, options.new_runner(out, False, jobs), out)[0]
