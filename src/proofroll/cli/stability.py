"""Where engines stop being right: the stability map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli.options import (
    CONTRADICTED,
    ENGINE,
    OK,
    Engines,
    Fresh,
    Jobs,
    Json,
    Out,
    Scheduler,
    complain,
    new_runner,
    progress_bar,
    require_pages,
    write_json,
)

_SceneOrFile = Annotated[
    str, typer.Argument(help="A scene, or a file that asks for a map of it, e.g. comparisons/stability.toml.")
]


def stability(
    scene: _SceneOrFile,
    engine: Engines = None,
    axis: Annotated[list[str] | None, typer.Option(help="Axis of the map, e.g. V0; repeat. All by default.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Three values per axis, and fewer steps per run.")] = False,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Map up to which step or tolerance each engine is stable, and right, along axes of extremes."""
    from proofroll.report.stability_map import draw
    from proofroll.studies.axes import chosen
    from proofroll.studies.stability_claims import file_for
    from proofroll.studies.stability_places import QUICK, Effort
    from proofroll.studies.study_store import make_stability

    asked = file_for(scene)
    axes = chosen(asked.axes, axis or [])
    effort = QUICK if quick else Effort()
    require_pages()
    runner = new_runner(out, fresh, jobs, scheduler)
    with progress_bar("stability", None) as advance:
        study, path = make_stability(asked, axes, runner, out, engines=engine or [], effort=effort, progress=advance)
    contradictions = study.claims.contradictions if study.claims else []
    draw(study, path.with_suffix(".svg"))
    if as_json:
        write_json(study)
    else:
        from proofroll.report.stability_tables import boundary_table, headline, silent_lines
        from proofroll.report.terminal import console

        terminal = console()
        terminal.print(headline(study), markup=False)
        terminal.print()
        terminal.print(boundary_table(study))
        terminal.print()
        worst = list(silent_lines(study))
        if worst:
            terminal.print("The worst that nobody is told of:", markup=False)
        for line in worst:
            terminal.print(f"  {line}", markup=False)
        for line in study.findings:
            terminal.print(line, markup=False)
        for place in study.places:
            if place.problem:
                terminal.print(f"{place.axis} = {place.value:g}: {place.problem}", markup=False)
        for name, reason in study.absent.items():
            terminal.print(f"{name}: {reason}", markup=False)
        for line in contradictions:
            terminal.print(f"!! {line}", markup=False)
        terminal.print(f"The map is in {path.with_suffix('.svg')}, everything in {path}.", markup=False)
    if study.absent and not study.points:
        for name, reason in study.absent.items():
            complain(f"{name}: {reason}")
        raise typer.Exit(ENGINE)
    raise typer.Exit(CONTRADICTED if contradictions else OK)
