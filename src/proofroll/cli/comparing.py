"""Comparison files: verdicts, the report and the regime map."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from proofroll.cli.common import (
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
    from proofroll.runner import Runner
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
    from proofroll.comparison_file import load_comparison
    from proofroll.report.content import outcome_content

    loaded = load_comparison(comparison)
    outcomes = _outcomes([loaded], engine or [], new_runner(out, fresh, jobs))
    content = outcome_content(outcomes[0])
    if as_json:
        write_json(content)
    else:
        _print_outcome(content)
    raise typer.Exit(_exit_code(outcomes))


def report(
    studies: Annotated[list[str] | None, typer.Argument(help="Comparison files or names; all by default.")] = None,
    engine: Engines = None,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Run the comparisons and write report.html and report.json."""
    from proofroll.comparison_file import comparison_names, load_comparison
    from proofroll.report.html import write_report

    loaded = [load_comparison(name) for name in studies or comparison_names()]
    runner = new_runner(out, fresh, jobs)
    outcomes = _outcomes(loaded, engine or [], runner)
    command = "proofroll report " + " ".join(studies or [])
    maps = [_regime_maps(item, jobs) if item.regimes else [] for item in loaded]
    content = write_report(outcomes, runner.store, out, command.strip(), maps)
    if as_json:
        write_json(content)
    else:
        for item in content["comparisons"]:
            _print_outcome(item)
        from proofroll.report.terminal import console

        console().print(f"The report is in {out / 'report.html'}; the same content in {out / 'report.json'}.")
    raise typer.Exit(_exit_code(outcomes))


def regimes(
    study: Annotated[str, typer.Argument(help="A comparison file with a [regimes] table, or its name.")] = "stick_slip",
    out: Out = Path("out"),
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Draw the map over speed and friction: never slips, slips and recovers, falls."""
    from proofroll.comparison_file import load_comparison
    from proofroll.report.regime_map import draw, regime_content
    from proofroll.store import Store, write_text

    loaded = load_comparison(study)
    Store(out)  # fails before the work rather than after it
    maps = _regime_maps(loaded, jobs)
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


def _outcomes(comparisons: list[Any], engines: list[str], runner: Runner) -> list[Outcome]:
    """Runs all comparisons with one progress bar."""
    from proofroll.studies.compare import evaluate
    from proofroll.studies.planning import plan

    plans = [plan(comparison, engines, runner.workers) for comparison in comparisons]
    cases = {case.key: case for item in plans for case in item.cases}
    with progress_bar("cases", total=len(cases)) as advance:
        results = runner.run(cases.values(), lambda case, _: advance(case.engine.name))
    if runner.damaged:
        complain(f"{len(runner.damaged)} stored results were damaged and have been run again")
    return [evaluate(item, results, runner) for item in plans]


def _regime_maps(comparison: Any, jobs: int | None) -> list[Any]:
    """The comparison's regime maps, with a progress bar."""
    import os

    from proofroll.studies.regimes import regime_maps

    total = comparison.regimes.count if comparison.regimes else None
    with progress_bar("runs of the truth", total=total) as advance:
        return regime_maps(comparison, jobs or os.cpu_count() or 1, lambda count: advance("runs of the truth", count))


def _exit_code(outcomes: list[Outcome]) -> int:
    if any(outcome.lost for outcome in outcomes):
        return ENGINE
    return CONTRADICTED if any(outcome.contradictions for outcome in outcomes) else OK


def _print_outcome(content: dict[str, Any]) -> None:
    from proofroll.report.terminal import closing_lines, console, verdict_table

    out = console()
    out.print(verdict_table(content))
    for line in closing_lines(content):
        out.print(line, markup=False)
    out.print()
