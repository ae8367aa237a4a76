"""Commands ``stability`` and ``ladder``: a map of steps that hold, and one quantity by ever fuller models."""

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options


def stability(
    scene: Annotated[
        str,
        typer.Argument(
            help="A scene, or the file, or its name, that asks for a map of it, e.g. stability.",
            callback=options.own_first,
        ),
    ],
    _root: options.Root = None,
    engine: options.Engines = None,
    axis: Annotated[list[str] | None, typer.Option(help="Axis of the map, e.g. V0; repeat. All by default.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Three values per axis, and fewer steps per run.")] = False,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
) -> None:
    """Map up to which step each engine is stable, and right. The map goes along axes of extremes."""
    options.begin_workers()
    from proofroll.report.page.html import templates
    from proofroll.report.pages import rendered
    from proofroll.report.stability.part import StabilityPart
    from proofroll.report.stability.tables import stability_parts
    from proofroll.running.store import write_text
    from proofroll.studies.stability.axes import QUICK, Effort, chosen
    from proofroll.studies.stability.claims import file_for
    from proofroll.studies.stability.study import make_stability

    asked = file_for(scene)
    axes = chosen(asked.axes, axis or [])
    effort = QUICK if quick else Effort()
    options.require_pages()
    runner = options.new_runner(out, fresh, jobs, scheduler)
    with options.progress_bar("stability", None) as advance:
        study, path = make_stability(asked, axes, runner, out, engines=engine or [], effort=effort, progress=advance)
    part = StabilityPart(asked, engine or [], study, folder=path.stem)
    part.named, part.out = scene, out
    write_text(path.with_suffix(".html"), rendered(templates(), "stability_page.html", entry=part.entry()))
    options.show(study, as_json, lambda: stability_parts(study, path))
    if study.absent and not study.points:
        for name, reason in study.absent.items():
            options.complain(f"{name}: {reason}")
        raise typer.Exit(options.ENGINE)
    raise typer.Exit(options.CONTRADICTED if study.claims.contradictions else options.OK)


def ladder(
    scene: options.SceneName,
    settings: options.Set = None,
    _root: options.Root = None,
    quantity: Annotated[
        str | None, typer.Option(help="Observable; by default the scene's deciding observable.")
    ] = None,
    tolerance: Annotated[float | None, typer.Option(help="Error of it that is allowed, in its unit.")] = None,
    until: options.Until = None,
    engine: options.Engines = None,
    rounds: Annotated[
        int | None,
        typer.Option(min=2, help="Rounds of timing; fewer say less. By default as many as an interval of 95 % needs."),
    ] = None,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
) -> None:
    """Compare one quantity across models of increasing detail. Each optional term is then off and on."""
    options.begin_workers()
    from proofroll.report.ladder import ladder_content, ladder_parts
    from proofroll.studies.ladder.ladder import Ladder

    study = Ladder(
        scene,
        options.assignments(settings),
        options.new_runner(out, fresh, jobs, scheduler),
        quantity=quantity,
        until=until,
        tolerance=tolerance,
        engines=list(dict.fromkeys(engine or [])),
        rounds=rounds,
    )
    with options.progress_bar("runs") as advance:
        study.run(advance)
    content = ladder_content(study)
    options.show(content, as_json, lambda: ladder_parts(content))
    lost = {"crashed", "timeout", "missing"}
    statuses = {rung.ran.status for rung in content.rungs}
    raise typer.Exit(options.ENGINE if content.absent or statuses & lost else options.OK)
