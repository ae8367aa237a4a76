"""Speed against accuracy: the curves, and the recommendation made from them."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from proofroll.cli.common import (
    CONTRADICTED,
    OK,
    Fresh,
    Jobs,
    Json,
    Out,
    Set,
    assignments,
    new_runner,
    progress_bar,
    write_json,
)
from proofroll.errors import InputError

if TYPE_CHECKING:
    from proofroll.studies.claims import TradeoffClaims
    from proofroll.studies.sweep import Question

_SceneOrFile = Annotated[
    str, typer.Argument(help="A scene, or a comparison file for it, e.g. comparisons/tradeoff.toml.")
]
_Until = Annotated[float | None, typer.Option("--until", help="Length of every run [s].")]
_Over = Annotated[
    list[str] | None, typer.Option(help="parameter=low:high over which the best points are checked; repeat.")
]
_DEFAULT_UNTIL = 2.0
# Of SI, before the unit of a tolerance; the second µ is the Greek letter.
_PREFIXES = {"k": 1e3, "m": 1e-3, "µ": 1e-6, "\u03bc": 1e-6, "u": 1e-6, "n": 1e-9}


def tradeoff(
    scene: _SceneOrFile,
    quantity: Annotated[
        list[str] | None, typer.Option(help="Observable to show; repeat. The first decides how far curves go.")
    ] = None,
    settings: Set = None,
    engine: Annotated[
        list[str] | None, typer.Option(help="Engine, or name[key=value,…]; repeat. All by default.")
    ] = None,
    over: _Over = None,
    until: _Until = None,
    every_point: Annotated[bool, typer.Option("--all", help="List every point, not only the best.")] = False,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Measure error against cost for every engine, formulation and setting, from coarse to fine."""
    from proofroll.report.tradeoff_tables import budget_lines, budget_table, corner_table, front_tables, point_table
    from proofroll.report.work_precision import draw
    from proofroll.studies.tradeoff import stored

    claims, question = _question(scene, settings, quantity, until)
    _require_observables(question, quantity or [])
    ranges = _ranges(question, over) if over is not None else (claims.over if claims else {})
    study = _measure(question, engine or [], ranges, out, fresh=fresh, jobs=jobs)
    contradictions = claims.contradictions(study) if claims and not engine else []
    study["claims"] = {"file": claims.name if claims else None, "contradictions": contradictions}
    path = stored(out, question, engine or ())
    shown = [name for name in quantity or [] if name in study["quantities"]] or default_quantities(study)
    draw(study, shown, path.with_suffix(".svg"))
    if as_json:
        write_json(study)
    else:
        from proofroll.report.terminal import console

        terminal = console()
        if every_point:
            terminal.print(point_table(study, study["points"], shown, "Every point"))
        else:
            for table in front_tables(study, shown):
                terminal.print(table)
        if study["over"]:
            terminal.print()
            terminal.print(corner_table(study, shown[0]))
        terminal.print()
        terminal.print(budget_table(study, shown[0]))
        terminal.print()
        for line in [*(budget_lines(study, shown[0]) if every_point else ()), *study["findings"]]:
            terminal.print(line, markup=False)
        for name, reason in study["absent"].items():
            terminal.print(f"{name}: {reason}", markup=False)
        for line in contradictions:
            terminal.print(f"!! {line}", markup=False)
        terminal.print(f"The diagram is in {path.with_suffix('.svg')}, everything in {path}.", markup=False)
    raise typer.Exit(CONTRADICTED if contradictions else OK)


def recommend(
    scene: _SceneOrFile,
    quantity: Annotated[str, typer.Option(help="Observable that matters.")] = "",
    tolerance: Annotated[
        str, typer.Option(help="Largest error: 1e-3 in its unit, '1 mm', or '1 %' of its scale.")
    ] = "",
    budget: Annotated[float | None, typer.Option(help="Wall seconds per simulated second that you can afford.")] = None,
    settings: Set = None,
    engine: Annotated[
        list[str] | None, typer.Option(help="Choose among these engines, name[key=value,…]; repeat.")
    ] = None,
    over: _Over = None,
    until: _Until = None,
    measure: Annotated[bool, typer.Option("--measure", help="Measure first if no curves are stored.")] = False,
    out: Out = Path("out"),
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Name the cheapest engine, formulation and step that holds a tolerance here, and why.

    It chooses among models of engines; solutions of the scene's own equations (closed form, reduced, projection) are
    told apart, unless --engine asks for them. Of the cheaper ones, which all fail, the most accurate is shown.
    """
    from proofroll.metrics import units
    from proofroll.registry import parse_engine, require_engine
    from proofroll.report.tradeoff_tables import answer_lines
    from proofroll.studies.recommend import Wish
    from proofroll.studies.recommend import recommend as answered

    claims, question = _question(scene, settings, [quantity] if quantity else None, until)
    _require_observables(question, [question.quantity])  # before minutes are spent on measuring
    for text in engine or []:
        require_engine(parse_engine(text).name)
    unit = units(question.loaded().rolling)[question.quantity]
    wish = Wish(question.quantity, _tolerance(tolerance, unit), _positive("budget", budget), tuple(engine or ()))
    ranges = _ranges(question, over) if over is not None else None
    study = _stored_study(question, engine or [], claims, ranges, out, jobs, measure=measure)
    answer = answered(study, wish)
    if as_json:
        write_json(answer)
    else:
        from proofroll.report.terminal import console

        for line in answer_lines(answer):
            console().print(line, markup=False)
    raise typer.Exit(OK if answer["choice"] and answer["affordable"] else CONTRADICTED)


def default_quantities(study: dict[str, Any]) -> list[str]:
    """Path, reaction, onset and energy, as far as the scene has them."""
    wanted = [study["quantity"], "N", "F3", "first_slip", "energy_balance"]
    return [name for name in dict.fromkeys(wanted) if name in study["quantities"]][:4]


def _question(
    scene: str, settings: list[str] | None, quantities: list[str] | None, until: float | None
) -> tuple[TradeoffClaims | None, Question]:
    """What is asked: the file's own question, or another about its scene, for which the file then claims nothing."""
    from proofroll.recording import time_grid
    from proofroll.scene_file import load_scene
    from proofroll.studies.claims import claims_for, load_claims
    from proofroll.studies.sweep import Question

    path = Path(scene)
    claims = load_claims(path) if path.suffix == ".toml" else claims_for(scene)
    name = claims.scene if claims else scene
    given = dict(assignments(settings or []))
    if claims and not given and until is None:
        quantity = quantities[0] if quantities else claims.quantity
        return claims, Question(name, claims.parameters, claims.until, quantity)
    loaded = load_scene(name, **given)  # type: ignore[arg-type]  # text is checked and converted there
    length = _DEFAULT_UNTIL if until is None else until
    time_grid(length, length or 1.0)
    if length <= 0:
        raise InputError("until", length, "give a positive time in s")
    quantity = quantities[0] if quantities else loaded.rolling.surface.coordinates[-1]
    return None, Question(name, {key: loaded.parameters[key] for key in given}, length, quantity)


def _require_observables(question: Question, names: list[str]) -> None:
    """Refuses what no run of the scene can be asked for."""
    from proofroll.metrics import units

    known = units(question.loaded().rolling)
    for name in names:
        if name not in known:
            raise InputError("quantity", name, f"there is no such observable; choose from {', '.join(known)}")


def _ranges(question: Question, texts: list[str]) -> dict[str, list[float]]:
    """Reads ``parameter=low:high``; each end must be one that the scene can have."""
    from proofroll.scene_file import load_scene

    found = {}
    for name, text in assignments(texts, "--over").items():
        try:
            low, high = (float(part) for part in text.split(":"))
        except ValueError:
            raise InputError(f"over: {name}", text, "write parameter=low:high in SI units") from None
        for value in (low, high):
            load_scene(question.scene, **{**question.parameters, name: value})
        if not low < high:
            raise InputError(f"over: {name}", text, "write the lower end first: parameter=low:high")
        found[name] = [low, high]
    return found


def _tolerance(text: str, unit: str) -> Any:
    """Reads ``1e-3``, ``1e-3 m``, ``1 mm`` or ``1 %``."""
    from proofroll.comparison import Tolerance

    if not text:
        raise InputError("tolerance", text, "give the largest error that you can bear, e.g. --tolerance 1e-3")
    advice = f"write a positive number in {unit}, e.g. 1e-3, or 1 % of the quantity's scale"
    found = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S*)\s*", text)
    if found is None:
        raise InputError("tolerance", text, advice)
    number, given = found[1], found[2] or unit
    if given not in {unit, "%"}:
        if given[1:] != unit or given[0] not in _PREFIXES:
            raise InputError("tolerance", text, f"the unit of this quantity is {unit}")
        number = f"{float(number) * _PREFIXES[given[0]]:.17g}"
    try:
        return Tolerance.parse("tolerance", f"{number} {given if given == '%' else unit}")
    except InputError:
        raise InputError("tolerance", text, advice) from None


def _positive(name: str, value: float | None) -> float | None:
    if value is not None and not 0 < value < float("inf"):
        raise InputError(name, value, "give a positive number of seconds")
    return value


def _stored_study(
    question: Question,
    engines: list[str],
    claims: TradeoffClaims | None,
    ranges: dict[str, list[float]] | None,
    out: Path,
    jobs: int | None,
    *,
    measure: bool,
) -> dict[str, Any]:
    """The stored curves, of all engines or of those that are asked for, or new ones if the user agrees.

    With ``ranges`` of parameters they must have been checked over these.

    Raises:
        InputError: there are none that hold here, and nobody agreed to measure them.
    """
    from proofroll.studies import installed
    from proofroll.studies.tradeoff import stored

    reasons = ["no curves are stored for this question"]
    for path in (stored(out, question), stored(out, question, engines)):
        try:
            study: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            reasons = installed.changes(study["measured"])
            if ranges is not None and study["over"] != ranges:
                reasons.append("the stored curves were not checked over these ranges")
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if not reasons:
            return study
    why = "; ".join(reasons[:3]) + (f"; and {len(reasons) - 3} more" if len(reasons) > 3 else "")
    if not measure and sys.stdin.isatty() and sys.stderr.isatty():
        measure = typer.confirm(f"{why}. Measure now (some minutes)?", err=True)
    if not measure:
        advice = f"{why}; add --measure, which takes some minutes, or run proofroll tradeoff first"
        raise InputError("stored curves", "none that hold here", advice)
    over = ranges if ranges is not None else (claims.over if claims else {})
    return _measure(question, engines, over, out, fresh=False, jobs=jobs)


def _measure(
    question: Question,
    engines: list[str],
    over: dict[str, list[float]],
    out: Path,
    *,
    fresh: bool,
    jobs: int | None,
) -> dict[str, Any]:
    """Measures, and stores what a recommendation can be made from."""
    from proofroll.store import write_text
    from proofroll.studies.tradeoff import stored
    from proofroll.studies.tradeoff import tradeoff as measured
    from proofroll.studies.tradeoff_content import content
    from proofroll.timing import write_benchmarks

    runner = new_runner(out, fresh, jobs)
    with progress_bar("runs and timings") as advance:
        found = measured(question, runner, engines=engines, over=over, progress=advance)
    study = content(found)
    path = stored(out, question, engines)
    write_text(path, json.dumps(study))
    names = {
        point.case.key: f"{curve.engine} {point.step or ''}".strip() for curve in found.curves for point in curve.points
    }
    write_benchmarks({names[key]: timing for key, timing in found.timings.items()}, path.with_suffix(".pyperf.json"))
    return study
