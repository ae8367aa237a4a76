"""Benchmarks of the speed that the project claims for itself and of its cost, measured on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from proofroll.cli import options

bench = typer.Typer(help="Measure speed, and what proofroll itself costs.", rich_markup_mode=None)

Rounds = Annotated[int, typer.Option("--rounds", min=2, help="Measurements of each, in turns.")]


@bench.command()
def adapters(
    engine: options.Engines = None,
    preset: Annotated[
        str, typer.Option(help="Preset of the formulations that have it; of others their first.")
    ] = "matched",
    rounds: Rounds = 7,
    seconds: Annotated[float, typer.Option(min=1e-3, help="Least length of one measurement [s].")] = 0.1,
    out: Annotated[Path | None, typer.Option(help="Write what --json prints to this file too.")] = None,
    as_json: options.Json = False,
) -> None:
    """Compare each adapter with the bare loop that a careful user of its engine would write.

    A row that cannot be measured is a failure, exit code 1. Without --engine: all engines that announce a bare loop.
    """
    from proofroll.core.entry_points import announced
    from proofroll.core.plugins import engine_names, require_engine
    from proofroll.running.store import write_text
    from proofroll_benchmarks.adapters import bench_adapters, content
    from proofroll_benchmarks.bare import GROUP
    from proofroll_benchmarks.tables import adapter_table

    for name in engine or ():
        require_engine(name)
    if out is not None:
        options.require_writable(out)
    with options.progress_bar("adapters") as advance:
        names = engine or [name for name in engine_names() if name in {point.name for point in announced(GROUP)}]
        table = content(bench_adapters(names, preset, rounds, seconds, progress=advance))
    if out is not None:
        write_text(out, options.json_text(table))
    options.show(table, as_json, lambda: [adapter_table(table), f"goal: at most {table['goal']:g}"])
    measured = [item for item in table["engines"].values() if item["ratio"] is not None]
    if engine and not measured:
        raise typer.Exit(options.ENGINE)
    if any(row["failed"] for item in table["engines"].values() for row in item["rows"]):
        raise typer.Exit(1)


@bench.command()
def study(
    engine: options.Engines = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Workers at once.")] = 2,
    seconds: Annotated[float, typer.Option(min=0.01, help="How long each case lasts inside its engine [s].")] = 1.0,
    as_json: options.Json = False,
) -> None:
    """Say what part of a study's wall time × workers is spent outside the engines, and on what."""
    from proofroll.core.plugins import engine_names, require_engine
    from proofroll_benchmarks.study import bench_study
    from proofroll_benchmarks.tables import study_lines, study_tables

    for name in engine or ():
        require_engine(name)
    with options.progress_bar("cases") as advance:
        found = bench_study(engine or engine_names(), jobs, seconds, progress=advance)
    options.show(found, as_json, lambda: [*study_tables(found), *study_lines(found)])


@bench.command()
def reference(
    rounds: Annotated[int, typer.Option("--rounds", min=2, help="Measurements of each, taken in turns.")] = 5,
    as_json: options.Json = False,
) -> None:
    """The compiled models against the engines: how many times faster, at how large an error."""
    from proofroll_benchmarks.reference import reference as measured
    from proofroll_benchmarks.tables import reference_tables

    with options.spinner("reference") as say:
        content: dict[str, Any] = measured(rounds, say)
    options.show(content, as_json, lambda: [part for table in reference_tables(content) for part in (table, "")])


@bench.command()
def cluster(
    scheduler: Annotated[str, typer.Option(help="As elsewhere: tcp://…, local:2; or threads.")] = "local:2",
    cases: Annotated[int, typer.Option(min=1, help="How many cases that compute nothing.")] = 1000,
    seconds: Annotated[float, typer.Option(min=0.0, help="How long each of them waits [s].")] = 0.0,
    as_json: options.Json = False,
) -> None:
    """Say what a cluster costs besides its cases: time, memory and store of the command that plans them."""
    from proofroll_benchmarks.cluster import bench_cluster
    from proofroll_benchmarks.tables import cluster_lines

    with options.progress_bar("cases", total=cases) as advance:
        found = bench_cluster(scheduler, cases, seconds, progress=advance)
    options.show(found, as_json, lambda: cluster_lines(found))
