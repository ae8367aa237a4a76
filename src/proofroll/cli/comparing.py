"""Comparison files: verdicts."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.number_format import number as written

if TYPE_CHECKING:
    from proofroll.core.comparison import Comparison
    from proofroll.running.case import Case, Result
    from proofroll.running.runner import Runner
    from proofroll.running.worker_pool import Workers
    from proofroll.studies.comparison.outcome import Outcome


def compare(
    comparison: Annotated[
        str,
        typer.Argument(help="A comparison file, e.g. comparisons/paper.toml, or its name; or a scene, a robot file."),
    ],
    engine: options.Engines = None,
    settings: options.Set = None,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    budget: options.Budget = None,
    as_json: options.Json = False,
) -> None:
    """Hold the engines of a comparison file against the truth; exit 1 if a verdict contradicts the file.

    Of a scene or a robot file every formulation that can represent it is run, and nothing is claimed. --set and
    --budget are for these: what 60 s of processor time do not suffice for is left out and named.
    """
    from proofroll.report.comparison.summary import outcome_content
    from proofroll.report.terminal.tables import verdict_parts
    from proofroll.running.worker_pool import Workers

    workers = Workers()
    with options.spinner(comparison):
        loaded = asked(comparison, options.assignments(settings), workers, budget, scheduler)
    tell_of_scene(comparison, loaded)
    tell_left_out([loaded], engine or [])
    outcomes = outcomes_of([loaded], engine or [], options.new_runner(out, fresh, jobs, scheduler, workers))
    content = outcome_content(outcomes[0])
    options.show(content, as_json, lambda: verdict_parts(content))
    raise typer.Exit(exit_code(outcomes))


def asked(
    name: str, parameters: Mapping[str, str], workers: Workers, budget: float | None, scheduler: str | None
) -> Comparison:
    """The comparison of this name, or that of a scene about which no file says anything, within a budget.

    Args:
        name: of a comparison or a scene.
        parameters: of a scene, those that differ from the defaults.
        workers: in which engines are asked.
        budget: processor time of all runs of a scene [s]; None: the usual one, but on a cluster, which has none.
        scheduler: of the cluster.

    Raises:
        InputError: there is neither, or something was given for a scene and this is a comparison, which has its own.
    """
    from proofroll.core.errors import InputError
    from proofroll.files.comparison_file import load_comparison
    from proofroll.files.scene_file import means_scene

    if means_scene(name, alone=bool(budget or parameters)):
        from proofroll.studies.comparison.default_comparison import BUDGET, compared

        if budget and scheduler:
            raise InputError("--budget", budget, "what runs on a cluster has none; drop --scheduler")
        return compared(name, parameters, workers, None if scheduler else budget or BUDGET)
    if budget:
        raise InputError("--budget", budget, "a comparison file runs all that it asks for; name a scene, or use report")
    if parameters:
        raise InputError("--set", next(iter(parameters)), "a comparison file has its own points; name a scene instead")
    return load_comparison(name)


def tell_of_scene(name: str, comparison: Comparison) -> None:
    """Says on standard error that a name is a scene's, too, if its comparison lacks an engine that is installed."""
    from proofroll.core.plugins import engine_names, parse_engine
    from proofroll.files.scene_file import is_scene

    lacking = sorted(set(engine_names()) - {parse_engine(row.engine).name for row in comparison.rows})
    if lacking and is_scene(name) and comparison.budget is None:
        rows = f"{name} is the comparison of that name, which has no row of {', '.join(lacking)}"
        options.complain(f"{rows}; the scene alone, with every engine: proofroll compare {name} --budget 60")


def tell_left_out(comparisons: Sequence[Comparison], engines: Sequence[str]) -> None:
    """Names on standard error each engine that is missing from some of the comparisons, one line each."""
    from proofroll.core.plugins import parse_engine, plain_name

    rows = {item.name: {parse_engine(row.engine).name for row in item.rows} for item in comparisons}
    asked_for = {name: {name, plain_name(name)} for name in engines}
    wanted = set(chain(*asked_for.values()))  # a comparison that has none of them is refused elsewhere
    for name, either in asked_for.items():
        without = [comparison for comparison, known in rows.items() if known & wanted and not known & either]
        if without:
            said = f"{name} is left out of {', '.join(without)}: no row is of it"
            options.complain(f"{said}; proofroll new comparison writes a file with one")


def outcomes_of(
    comparisons: list[Comparison],
    engines: list[str],
    runner: Runner,
    stage: str = "",
    finished: Callable[[dict[int, Outcome], bool], None] | None = None,
    budget: float | None = None,
) -> list[Outcome]:
    """Runs all comparisons with one progress bar, one after the other as far as that leaves no worker idle.

    Each is brief first; when all have been, they grow by their further combinations.

    Args:
        comparisons: in their order.
        engines: to which they are restricted.
        runner: runs their cases.
        stage: is put before what the bar says.
        finished: called when one has ended, briefly or whole, with all that have by their numbers; True: the last.
        budget: processor time of all of them [s]; all runs then come before the first ladder.
    """
    from proofroll.running.time_budget import TimeBudget
    from proofroll.studies.comparison.compare import evaluate, left_out, run_plan
    from proofroll.studies.comparison.planning import plan

    limit = TimeBudget(budget) if budget else None
    with options.spinner(f"{stage}cases"):
        plans = [plan(comparison, engines, runner.workers) for comparison in comparisons]
    brief = [item.brief for item in plans]
    grown = {at: item for at, item in enumerate(plans) if len(item.truths) > len(brief[at].truths)}
    parts = [*enumerate(brief), *grown.items()]
    if limit:
        order = [cases for item in brief for cases in item.stages[:-1]]
        order += [item.stages[-1] for item in brief]
        order += [item.cases for item in grown.values()]
    else:
        order = [item.cases for _, item in parts]
    place = {case.key: at for at, items in reversed([*enumerate(order)]) for case in items}
    cases = {case.key: case for items in order for case in items}
    missing = {number: {case.key for case in item.cases} for number, (_, item) in enumerate(parts)}
    results: dict[str, Result] = {}
    ended: dict[int, Outcome] = {}
    start, reused = time.monotonic(), runner.reused

    def end(key: str = "") -> None:
        """Judges each comparison, brief or whole, whose last case this was."""
        for number in [number for number, keys in missing.items() if keys <= {key}]:
            del missing[number]
            at, part = parts[number]
            if part is plans[at] or at not in grown:
                part = plans[at].ended(left_out(results))
            elif not finished:
                continue
            ended[at] = evaluate(part, results, runner)
            if finished:
                finished(ended, not missing)

    with options.progress_bar(f"{stage}cases", total=len(cases)) as advance:

        def told(case: Case, result: Result) -> None:
            results[case.key] = result
            ran = len(results) - (runner.reused - reused)
            seconds = (time.monotonic() - start) / ran * (len(cases) - len(results)) if ran else 0.0
            seconds = min(seconds, limit.left / runner.jobs) if limit else seconds
            of = f"{min(len(ended) + 1, len(plans))} of {len(plans)} comparisons, " if len(plans) > 1 else ""
            advance(f"{stage}{of}{f'about {written(seconds, 1)} s left, ' if ran else ''}{case.engine.name}")
            end(case.key)
            for keys in missing.values():
                keys.discard(case.key)

        for item in plans:
            if item.comparison.budget:
                run_plan(item, runner, told)
        runner.run((case for key, case in cases.items() if key not in results), told, limit, place)
        end()
    if runner.damaged:
        options.complain(f"{len(runner.damaged)} stored results were damaged and have been run again")
    return [ended[at] for at in range(len(plans))]


def exit_code(outcomes: list[Outcome]) -> int:
    """3 if an engine was lost, 1 if a verdict contradicts its file, else 0."""
    if any(outcome.lost for outcome in outcomes):
        return options.ENGINE
    return options.CONTRADICTED if any(outcome.contradictions for outcome in outcomes) else options.OK
