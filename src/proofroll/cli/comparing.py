"""Comparison files: verdicts and the regime map."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
    complain,
    new_runner,
    progress_bar,
    write_json,
)

if TYPE_CHECKING:
    from proofroll.running.runner import Runner
    from proofroll.studies.compare import Outcome


def compare(
    comparison: Annotated[str, typer.Argument(help="A comparison file, e.g. comparisons/paper.toml, or its name.")],
    engine: Engines = None,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Hold the engines of a comparison file against the truth; exit 1 if a verdict contradicts the file."""
    from proofroll.files.comparison_file import load_comparison
    from proofroll.report.comparison_content import outcome_content

    loaded = load_comparison(comparison)
    outcomes = outcomes_of([loaded], engine or [], new_runner(out, fresh, jobs))
    content = outcome_content(outcomes[0])
    if as_json:
        write_json(content)
    else:
        print_outcome(content)
    raise typer.Exit(exit_code(outcomes))


def regimes(
    study: Annotated[str, typer.Argument(help="A comparison file with a [regimes] table, or its name.")] = "stick_slip",
    out: Out = Path("out"),
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Draw the map over speed and friction: never slips, slips and recovers, falls."""
    from proofroll.elements.ball_on_surface.report.regime_map import draw, regime_content
    from proofroll.files.comparison_file import load_comparison
    from proofroll.running.store import Store, write_text

    loaded = load_comparison(study)
    Store(out)  # fails before the work rather than after it
    maps = regime_maps_of(loaded, jobs)
    content = regime_content(maps)
    draw(maps, out / "regimes.svg")
    write_text(out / "regimes.json", json.dumps(content, indent=1))
    if as_json:
        write_json(content)
        return
    from proofroll.report.terminal import console

    for item in content["maps"]:
        said = ", ".join(f"{count} {name}" for name, count in item["counts"].items())
        console().print(f"f = {item['rolling_resistance']:g} m, {item['runs']} runs of {item['until']:g} s: {said}.")
        if item["outside_boundaries"] is not None:
            console().print(f"  {item['outside_boundaries']} of them on the wrong side of the analytic boundaries.")
    console().print(f"The map is in {out / 'regimes.svg'}, its numbers in {out / 'regimes.json'}.")


def outcomes_of(comparisons: list[Any], engines: list[str], runner: Runner, stage: str = "") -> list[Outcome]:
    """Runs all comparisons with one progress bar; ``stage`` is put before what it says."""
    from proofroll.studies.compare import evaluate
    from proofroll.studies.planning import plan

    plans = [plan(comparison, engines, runner.workers) for comparison in comparisons]
    cases = {case.key: case for item in plans for case in item.cases}
    with progress_bar(f"{stage}cases", total=len(cases)) as advance:
        results = runner.run(cases.values(), lambda case, _: advance(f"{stage}{case.engine.name}"))
    if runner.damaged:
        complain(f"{len(runner.damaged)} stored results were damaged and have been run again")
    return [evaluate(item, results, runner) for item in plans]


def regime_maps_of(comparison: Any, jobs: int | None, stage: str = "") -> list[Any]:
    """The comparison's regime maps, with a progress bar."""
    import os

    from proofroll.elements.ball_on_surface.regimes_study import regime_maps

    total = comparison.regimes.count if comparison.regimes else None
    words = f"{stage}runs of the truth"
    with progress_bar(words, total=total) as advance:
        return regime_maps(comparison, jobs or os.cpu_count() or 1, lambda count: advance(words, count))


def exit_code(outcomes: list[Outcome]) -> int:
    """3 if an engine was lost, 1 if a verdict contradicts its file, else 0."""
    if any(outcome.lost for outcome in outcomes):
        return ENGINE
    return CONTRADICTED if any(outcome.contradictions for outcome in outcomes) else OK


def print_outcome(content: dict[str, Any]) -> None:
    """A comparison on the terminal: the table of verdicts, and what came of it in words."""
    from proofroll.report.terminal import closing_lines, console, verdict_table

    out = console()
    out.print(verdict_table(content))
    for line in closing_lines(content):
        out.print(line, markup=False)
    out.print()
