"""Command ``recommend``: the cheapest choice that holds a tolerance, from measured curves."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from proofroll.cli import options
from proofroll.cli.tradeoff import Over, measure, question_of, ranges_of, require_observables
from proofroll.core.errors import InputError, ProofrollError, require_known

if TYPE_CHECKING:
    from proofroll.core.comparison import Tolerance
    from proofroll.report.changes import EarlierReport
    from proofroll.studies.tradeoff.claims import TradeoffClaims
    from proofroll.studies.tradeoff.curve import Question
    from proofroll.studies.tradeoff.records import TradeoffStudy


def recommend(
    scenes: Annotated[
        list[str], typer.Argument(help="A scene, or a file of a trade-off; several scenes, studies or groups.")
    ],
    quantity: Annotated[str, typer.Option(help="Observable that matters.")] = "",
    tolerance: Annotated[
        str, typer.Option(help="Largest error: 1e-3 in its unit, '1 mm', or '1 %' of its scale.")
    ] = "",
    max_cost: Annotated[
        float | None, typer.Option(help="Wall seconds per simulated second that a run may take.")
    ] = None,
    budget: Annotated[float | None, typer.Option(hidden=True)] = None,
    settings: options.Set = None,
    engine: Annotated[
        list[str] | None, typer.Option(help="Choose among these engines, name[key=value,…]; repeat.")
    ] = None,
    over: Over = None,
    until: options.Until = None,
    measure_first: Annotated[
        bool, typer.Option("--measure", help="Measure first if no curves are stored, as tradeoff without --budget.")
    ] = False,
    forces: Annotated[bool, typer.Option("--forces", help="Forces count as the motion does; from a report.")] = False,
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

    For a group (as loops) and for several scenes or studies the runs of a report answer, OUT/report.json unless
    --report names another: a choice for each, and over all. The tolerance is then a part of the path, or '0.1 %' of it;
    by default 1e-4, as on the first screen. Where --forces asks for forces that are not judged, the choice is for
    motion alone.
    """
    from proofroll.files.scene_file import is_scene

    if budget is not None:
        raise InputError("--budget", budget, "here it is --max-cost; elsewhere a budget is processor time")
    found = out / "report.json"
    grouped = found.is_file() and not is_scene(scenes[0]) and not scenes[0].endswith(".toml")
    if len(scenes) > 1 or forces or grouped or report is not None:
        given = {
            "--quantity": quantity,
            "--max-cost": max_cost,
            "--set": settings,
            "--over": over,
            "--until": until,
            "--measure": measure_first,
        }
        for name, value in given.items():
            if value:
                raise InputError(name, value if value is not True else "given", "it is for one scene, without a report")
        from proofroll.report.changes import EarlierReport

        stored = EarlierReport.read(report or found, "--report" if report else "stored report")
        _from_report(scenes, tolerance, engine or [], stored, forces=forces, as_json=as_json)
    (scene,) = scenes
    from proofroll.core.plugins import engine_names, parse_engine, require_engine
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
    known = {*study.absent, *(point.engine for point in study.points)}
    not_measured = [] if engine else [name for name in engine_names() if name not in known]
    recommendation = replace(answered(study, required), not_measured=not_measured)
    options.show(recommendation, as_json, lambda: answer_lines(recommendation))
    raise typer.Exit(options.OK if recommendation.answer.choice and recommendation.affordable else options.CONTRADICTED)


def _from_report(
    names: list[str], tolerance: str, engines: list[str], report: EarlierReport, *, forces: bool, as_json: bool
) -> NoReturn:
    """Prints advice for several scenes from a report's runs, and exits: 1 if in one nothing holds the tolerance."""
    from proofroll.files.scene_file import is_scene
    from proofroll.files.toml import named_file
    from proofroll.report.page.advice import advice
    from proofroll.report.page.choice_matrix import FIRST_TOLERANCE, ChoiceStudy, choice_matrix

    path, lines = report.path, report.lines
    for name in engines:
        require_known("--engine", name, sorted({line.engine for line in lines}), f"{path} has")
    lines = [line for line in lines if not engines or line.engine in engines]
    studies: dict[str, ChoiceStudy] = {}
    for name in [name for text in names for name in text.split(",")]:
        own = [line for line in lines if name in {line.study, line.scene, line.group, *line.group.split()}]
        if not own:
            known = ", ".join(dict.fromkeys(line.group for line in lines))
            lacking = f"has no such scene, comparison or group; the groups there are {known}"
            if is_scene(name) or named_file(name):
                lacking = f"has no runs of it; proofroll report {name} makes them"
            raise InputError("scenes", name, f"{path} {lacking}")
        studies |= {line.study: ChoiceStudy(line.study, "") for line in own}
    part = _tolerance(tolerance, "1").absolute(1.0) if tolerance else FIRST_TOLERANCE
    matrix = choice_matrix(lines, studies)
    advised = advice(matrix, part, forces)
    content = {"report": str(path), "tolerance": part, "with_forces": forces, "advice": advised}
    key = "s/s: seconds of computing per second of motion; ~: to a factor of about two."
    options.show(content, as_json, lambda: [*(item.sentence for item in advised), key])
    single = [item for item, column in zip(advised, matrix.columns, strict=False) if len(column.studies) == 1]
    chosen = [bool(item.choice) for item in single if item.judged]
    raise typer.Exit(options.OK if chosen and all(chosen) else options.CONTRADICTED)


def _tolerance(text: str, unit: str) -> Tolerance:
    """Tolerance of the option. Raises InputError for another form or unit, ProofrollError if there is none."""
    from proofroll.core.comparison import Tolerance

    if not text:
        words = "give the largest error that you can bear, e.g. --tolerance 1e-3, or --tolerance '1 %' of the scale"
        raise ProofrollError(f"--tolerance is missing: {words}")
    return Tolerance.of_quantity("tolerance", text, unit)


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
            changes = [f"what is stored is of {', '.join(study.engines)}; choose among these with --engine"]
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
        raise InputError("stored curves", "none", advice)
    over = ranges if ranges is not None else (claims.over if claims else {})
    return measure(question, Extent(engines, over), claims, options.new_runner(out, False, jobs), out)[0]
