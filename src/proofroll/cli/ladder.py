"""One quantity up the ladder of models, and what each optional term is worth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli.options import (
    ENGINE,
    OK,
    Engines,
    Fresh,
    Jobs,
    Json,
    Out,
    SceneName,
    Scheduler,
    Set,
    assignments,
    new_runner,
    progress_bar,
    write_json,
)


def ladder(
    scene: SceneName,
    settings: Set = None,
    quantity: Annotated[str | None, typer.Option(help="What is asked, e.g. z, gamma, N. By default z.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Error of it that is allowed, in its unit.")] = None,
    until: Annotated[float, typer.Option(help="Last time [s].")] = 2.0,
    engine: Engines = None,
    rounds: Annotated[int | None, typer.Option(min=2, help="Rounds of timing; fewer say less. By default 5.")] = None,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Run one quantity up the ladder of models, and switch each optional term on and off."""
    from proofroll.report.ladder import ladder_content
    from proofroll.studies.ladder import Ladder

    study = Ladder(
        scene,
        dict(assignments(settings or [])),
        new_runner(out, fresh, jobs, scheduler),
        quantity=quantity,
        until=until,
        tolerance=tolerance,
        engines=list(dict.fromkeys(engine or [])),
        rounds=rounds,
    )
    with progress_bar("runs") as advance:
        study.run(advance)
    content = ladder_content(study)
    if as_json:
        write_json(content)
    else:
        from proofroll.report.ladder_tables import rung_table, term_table
        from proofroll.report.terminal import console

        terminal = console()
        terminal.print(rung_table(content))
        terminal.print()
        terminal.print(term_table(content))
        terminal.print()
        for sentence in content.findings:
            terminal.print(sentence, markup=False)
    lost = {"crashed", "timeout", "missing"}
    statuses = {rung.ran.status for rung in content.rungs}
    raise typer.Exit(ENGINE if content.absent or statuses & lost else OK)
