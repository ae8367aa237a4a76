"""Command ``tradeoff``: curves of error against cost."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError, Missing

if TYPE_CHECKING:
    from proofroll.running.runner import Runner
    from proofroll.studies.tradeoff.claims import TradeoffClaims
    from proofroll.studies.tradeoff.curve import Question
    from proofroll.studies.tradeoff.records import TradeoffStudy
    from proofroll.studies.tradeoff.tradeoff import Extent

SceneOrFile = Annotated[
    str,
    typer.Argument(
        help="A scene, or the file, or its name, of a trade-off, e.g. tradeoff.", callback=options.own_first
    ),
]
Over = Annotated[
    list[str] | None, typer.Option(help="parameter=low:high over which the best points are checked; repeat.")
]


def tradeoff(
    scene: SceneOrFile,
    quantity: Annotated[
        list[str] | None, typer.Option(help="Observable to show; repeat. The first decides how far curves go.")
    ] = None,
    settings: options.Set = None,
    control: options.Control = None,
    engine: Annotated[
        list[str] | None, typer.Option(help="Engine, or name[key=value,…]; repeat. All by default.")
    ] = None,
    over: Over = None,
    until: options.Until = None,
    budget: options.Budget = None,
    every_point: Annotated[bool, typer.Option("--all", help="List every point, not only the best.")] = False,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
) -> None:
    """Measure error against cost for every engine, formulation and setting, from coarse to fine.

    With all engines, and a scene that no file asks about, the study is brief and drops the points beyond --budget.
    """
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.report.tradeoff.tables import default_quantities, tradeoff_parts
    from proofroll.report.tradeoff.work_precision import svg
    from proofroll.running.store import write_text
    from proofroll.studies.tradeoff.tradeoff import Extent

    scene = options.controlled(scene, control)
    claims, question = question_of(scene, settings, quantity, until)
    require_observables(question, quantity or [])
    ranges = ranges_of(question, over) if over is not None else (claims.over if claims else {})
    runner = options.new_runner(out, fresh, jobs, scheduler)
    study, path = measure(question, Extent(engine or [], ranges, budget=budget), claims, runner, out)
    shown = [name for name in quantity or [] if name in study.quantities] or default_quantities(study)
    diagram = f"{path.with_suffix('.svg')} · {path.name} · every point: --all"
    if not as_json:
        try:
            write_text(path.with_suffix(".svg"), svg(study, shown))
        except Missing as missing:
            diagram = f"There is no diagram: {missing}. Everything is in {path}."
    parts = partial(tradeoff_parts, study, shown, every_point=every_point)
    options.show(study, as_json, lambda: [*parts(), diagram], widest=None if every_point else WIDTH)
    raise typer.Exit(options.CONTRADICTED if study.claims.contradictions else options.OK)


def question_of(
    scene: str, settings: list[str] | None, quantities: list[str] | None, until: float | None
) -> tuple[TradeoffClaims | None, Question]:
    """Claims and question of a file about a trade-off; with other parameters or times there are no claims (None)."""
    from proofroll.files.scene_file import is_scene, load_scene
    from proofroll.studies.cases import length_of, require_length
    from proofroll.studies.tradeoff.claims import claims_for, load_claims
    from proofroll.studies.tradeoff.curve import Question

    path = Path(scene)
    claims = load_claims(path) if path.suffix == ".toml" and not is_scene(scene) else claims_for(scene)
    name = claims.scene if claims else scene
    assigned = options.assignments(settings)
    if claims and not assigned and until is None:
        quantity = quantities[0] if quantities else claims.quantity
        return claims, Question(name, claims.parameters, claims.until, quantity)
    loaded = load_scene(name, **assigned)  # type: ignore[arg-type]  # text is checked and converted there
    length = length_of(name, until)
    require_length(length)
    quantity = quantities[0] if quantities else loaded.deciding
    return None, Question(name, {key: loaded.parameters[key] for key in assigned}, length, quantity)


def require_observables(question: Question, names: list[str]) -> None:
    """Raises InputError for a name that is no observable of a run of the scene."""
    scene = question.loaded
    for name in names:
        scene.observable(name)


def ranges_of(question: Question, texts: list[str]) -> dict[str, list[float]]:
    """Reads ``parameter=low:high``. Raises InputError for another form, or an end that the scene cannot have."""
    from proofroll.files.scene_file import load_scene

    ranges = {}
    for name, text in options.assignments(texts, "--over").items():
        try:
            low, high = (float(part) for part in text.split(":"))
        except ValueError:
            raise InputError(f"over: {name}", text, "write parameter=low:high in SI units") from None
        for value in (low, high):
            load_scene(question.scene, **{**question.parameters, name: value})
        if not low < high:
            raise InputError(f"over: {name}", text, "write the lower end first: parameter=low:high")
        ranges[name] = [low, high]
    return ranges


def measure(
    question: Question, extent: Extent, claims: TradeoffClaims | None, runner: Runner, out: Path
) -> tuple[TradeoffStudy, Path]:
    """Measures and stores the curves of a trade-off, with a progress bar.

    It has the default budget if all engines are asked, here, and no file has claims about the scene.
    """
    from proofroll.studies.comparison.default_comparison import BUDGET
    from proofroll.studies.tradeoff.study import make_tradeoff

    seconds = extent.budget or (None if claims or extent.engines or runner.cluster else BUDGET)
    with options.progress_bar("runs and timings") as advance:

        def tell(text: str, total: int) -> None:
            advance(text, total=total)

        return make_tradeoff(question, runner, out, replace(extent, budget=seconds), claims, tell)
