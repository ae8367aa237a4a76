"""Comparison files: verdicts."""

from __future__ import annotations

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
