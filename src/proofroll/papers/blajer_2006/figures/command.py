"""Command `figures`: draws the figures of an article from our own runs and checks its statements."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options

if TYPE_CHECKING:
    import xarray as xr


class Form(StrEnum):
    """Formats of a figure's file."""

    SVG = "svg"
    PNG = "png"
    PDF = "pdf"


def figures(
    study: Annotated[
        str, typer.Argument(help="A file that defines figures, its name, or the scene it is about.")
    ] = "paper_figures",
    engine: Annotated[
        str | None, typer.Option(help="truth, or name[key=value,…]; by default the one that the file names.")
    ] = None,
    form: Annotated[list[Form] | None, typer.Option("--format", help="Form of the files; repeat. svg.")] = None,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    as_json: options.Json = False,
) -> None:
    """Draw the paper's figures from runs; exit 1 if a number that it states does not hold."""
    from proofroll.papers.blajer_2006.figures import style
    from proofroll.papers.blajer_2006.figures.reading import load_figures
    from proofroll.papers.blajer_2006.figures.statement_tables import statement_table
    from proofroll.papers.blajer_2006.figures.study import run_figures
    from proofroll.papers.blajer_2006.figures.writing import closing_lines, write_figures
    from proofroll.report.figure import styled

    loaded = load_figures(study)
    with styled(style.SETTINGS):  # what is missing shows before the runs rather than after them
        pass
    runner = options.new_runner(out, fresh, jobs)
    with options.progress_bar("runs") as advance:
        made = run_figures(loaded, runner, engine, lambda case, _: advance(case.engine.name))
    maps = {name: _maps(name, jobs) for name in dict.fromkeys(item.regimes for item in loaded.figures) if name}
    content = write_figures(made, maps, out, list(dict.fromkeys(item.value for item in form or [Form.SVG])))
    options.show(content, as_json, lambda: [statement_table(content), *closing_lines(content, out)])
    for line in content["lost"]:
        options.complain(line)
    if content["lost"]:
        raise typer.Exit(options.ENGINE)
    contradicted = any(item["holds"] is False for item in content["statements"])
    raise typer.Exit(options.CONTRADICTED if contradicted else options.OK)


def _maps(name: str, jobs: int | None) -> list[xr.Dataset]:
    """Regime maps of a study, computed with a progress bar."""
    import os

    from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_maps

    plan = load_regimes(name)
    with options.progress_bar("runs of the truth", total=plan.runs) as advance:
        return regime_maps(plan, jobs or os.cpu_count() or 1, lambda count: advance("runs of the truth", count))
