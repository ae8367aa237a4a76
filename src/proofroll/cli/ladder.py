"""Command ``ladder``: one quantity by ever fuller models, and the value of each optional term."""

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options


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
    from proofroll.report.ladder.ladder import ladder_content
    from proofroll.report.ladder.tables import ladder_parts
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
