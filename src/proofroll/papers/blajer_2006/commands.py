"""Commands of the article: first slips, maps of regimes, figures."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from proofroll.cli import options

if TYPE_CHECKING:
    import xarray as xr
    from rich.table import Table

    from proofroll.papers.blajer_2006.slip.onset import OnsetStudy


paper = typer.Typer(
    help="Blajer's article (2006): first slips, regimes, figures.", rich_markup_mode=None, no_args_is_help=True
)


@paper.command()
def onset(
    scene: options.SceneName,
    settings: options.Set = None,
    engine: Annotated[list[str] | None, typer.Option(help="Engine with settings; repeat. All that can slip.")] = None,
    until: Annotated[float, typer.Option(help="How long to look for a slip [s].")] = 4.0,
    uncertainty: Annotated[float, typer.Option(help="Relative uncertainty of friction and resistance.")] = 1e-3,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
) -> None:
    """Say when the ball first slips, in every engine, and how well that is posed."""
    from proofroll.core.time_grid import time_grid
    from proofroll.papers.blajer_2006.slip.onset import onset_study, summary
    from proofroll.running.case import Status

    time_grid(until, 0.01)
    with options.progress_bar("runs") as advance:
        study = onset_study(
            scene,
            options.assignments(settings),
            options.new_runner(out, fresh, jobs, scheduler),
            engines=engine or (),
            until=until,
            uncertainty=uncertainty,
            progress=lambda case, _: advance(case.engine.name),
        )
    options.show(study, as_json, lambda: [summary(study), _onset_table(study)])
    verdicts = {item.verdict for item in study.engines}
    # Unless the engine was named, its refusal, or a model that is another scene, is an answer and no error.
    answers = set() if engine else {Status.REFUSED, Status.WRONG_MODEL}
    if any(item.verdict in {"failed", "refused"} and item.status not in answers for item in study.engines):
        raise typer.Exit(options.ENGINE)
    raise typer.Exit(options.CONTRADICTED if "disagree" in verdicts else options.OK)


def _onset_table(study: OnsetStudy) -> Table:
    """Table with a line per engine: its first slip with bracket, the difference from the truth, and the verdict."""
    from rich.table import Column
    from rich.text import Text

    from proofroll.core.number_format import number
    from proofroll.papers.blajer_2006.slip.onset import first_slip_texts
    from proofroll.report.labels import preset_name
    from proofroll.report.terminal.screen import numeric, plain_table, unbroken
    from proofroll.running.case import Status

    table = plain_table(
        Column("engine", overflow="fold"),
        *numeric("first slip [s]"),
        *unbroken("between [s]"),
        *numeric("difference [s]"),
        Column("verdict", overflow="fold"),
    )
    for item in study.engines:
        slip_texts = first_slip_texts(item.onset) if item.onset or item.status is Status.DONE else ("", "")
        verdict = item.verdict + (f": {item.message}" if item.verdict in {"failed", "refused"} else "")
        label = item.name, item.settings.get("formulation"), preset_name(item.settings.get("preset"))
        table.add_row(Text(" ".join(filter(None, label))), *slip_texts, number(item.difference), Text(verdict))
    return table


@paper.command()
def regimes(
    study: Annotated[str, typer.Argument(help='A file with study = "regimes", its name, or its scene.')] = "regimes",
    out: options.Out = Path("out"),
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
) -> None:
    """Draw the map over speed and friction: never slips, slips and recovers, falls."""
    from proofroll.papers.blajer_2006.report.regime_map import draw, regime_content
    from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_maps
    from proofroll.running.store import Store, write_text

    loaded = load_regimes(study)
    options.require_pages()
    Store(out)  # fails before the work rather than after it
    words = "runs of the truth"
    with options.progress_bar(words, total=loaded.runs) as advance:
        workers, cluster = jobs or os.cpu_count() or 1, options.new_cluster(scheduler)
        maps = regime_maps(loaded, workers, lambda count: advance(words, count), cluster)
    content = regime_content(maps)
    draw(maps, out / "regimes.svg")
    write_text(out / "regimes.json", options.json_text(content))
    options.show(content, as_json, lambda: _regime_lines(content, out))


def _regime_lines(content: Mapping[str, Any], out: Path) -> Iterator[str]:
    """Lines with the counts of runs by regime for each map, and the files of the maps."""
    for item in content["maps"]:
        counts = ", ".join(f"{count} {name}" for name, count in item["counts"].items())
        yield f"f = {item['rolling_resistance']:g} m, {item['runs']} runs of {item['until']:g} s: {counts}."
        if item["outside_boundaries"] is not None:
            yield f"  {item['outside_boundaries']} of them on the wrong side of the analytic boundaries."
    yield f"The map is in {out / 'regimes.svg'}, its numbers in {out / 'regimes.json'}."


class Form(StrEnum):
    """Formats of a figure's file."""

    SVG = "svg"
    PNG = "png"
    PDF = "pdf"


@paper.command()
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
    from proofroll.papers.blajer_2006.figures.study import run_figures
    from proofroll.papers.blajer_2006.figures.writing import closing_lines, statement_table, write_figures
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
    from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_maps

    plan = load_regimes(name)
    with options.progress_bar("runs of the truth", total=plan.runs) as advance:
        return regime_maps(plan, jobs or os.cpu_count() or 1, lambda count: advance("runs of the truth", count))
