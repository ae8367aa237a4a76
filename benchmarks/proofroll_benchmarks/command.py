"""Benchmarks: what speed the project claims for itself, and what it costs, measured on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from proofroll.cli.options import (
    ENGINE,
    Engines,
    Json,
    json_text,
    progress_bar,
    require_writable,
    spinner,
    write_json,
)

bench = typer.Typer(help="Measure speed, and what proofroll itself costs.", rich_markup_mode=None)

Rounds = Annotated[int, typer.Option("--rounds", min=2, help="Measurements of each, in turns.")]


@bench.command()
def adapters(
    engine: Engines = None,
    preset: Annotated[
        str, typer.Option(help="Preset of the formulations that have it; of others their first.")
    ] = "matched",
    rounds: Rounds = 7,
    seconds: Annotated[float, typer.Option(min=1e-3, help="Least length of one measurement [s].")] = 0.1,
    out: Annotated[Path | None, typer.Option(help="Write what --json prints to this file too.")] = None,
    as_json: Json = False,
) -> None:
    """Compare each adapter with the bare loop that a careful user of its engine would write."""
    from proofroll.core.plugins import engine_names, require_engine
    from proofroll.running.store import write_text
    from proofroll_benchmarks.adapters import bench_adapters, content

    for name in engine or ():
        require_engine(name)
    if out is not None:
        require_writable(out)
    with progress_bar("adapters") as advance:
        found = content(bench_adapters(engine or engine_names(), preset, rounds, seconds, progress=advance))
    if out is not None:
        write_text(out, json_text(found))
    if as_json:
        write_json(found)
    else:
        from proofroll.report.terminal import console
        from proofroll_benchmarks.tables import adapter_table

        console().print(adapter_table(found))
        console().print(f"goal: at most {found['goal']:g}")
    measured = [item for item in found["engines"].values() if item["ratio"] is not None]
    if engine and not measured:
        raise typer.Exit(ENGINE)


@bench.command()
def study(
    engine: Engines = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Workers at once.")] = 2,
    seconds: Annotated[float, typer.Option(min=0.01, help="How long each case lasts inside its engine [s].")] = 1.0,
    as_json: Json = False,
) -> None:
    """Say what part of a study's wall time × workers is spent outside the engines, and on what."""
    from proofroll.core.plugins import engine_names, require_engine
    from proofroll_benchmarks.study import bench_study

    for name in engine or ():
        require_engine(name)
    with progress_bar("cases") as advance:
        found = bench_study(engine or engine_names(), jobs, seconds, progress=advance)
    if as_json:
        write_json(found)
    else:
        from proofroll.report.terminal import console
        from proofroll_benchmarks.tables import study_lines, study_tables

        for part in (*study_tables(found), *study_lines(found)):
            console().print(part)


@bench.command()
def reference(
    rounds: Annotated[int, typer.Option("--rounds", min=2, help="Measurements of each, taken in turns.")] = 5,
    as_json: Json = False,
) -> None:
    """The compiled models against the engines: how many times faster, at how large an error."""
    from proofroll_benchmarks.reference import reference as measured

    with spinner("reference") as say:
        content: dict[str, Any] = measured(rounds, say)
    if as_json:
        write_json(content)
    else:
        from proofroll.report.terminal import console
        from proofroll_benchmarks.tables import reference_tables

        out = console()
        for table in reference_tables(content):
            out.print(table)
            out.print()


@bench.command()
def cluster(
    scheduler: Annotated[str, typer.Option(help="As elsewhere: tcp://…, local:2; or threads.")] = "local:2",
    cases: Annotated[int, typer.Option(min=1, help="How many cases that compute nothing.")] = 1000,
    seconds: Annotated[float, typer.Option(min=0.0, help="How long each of them waits [s].")] = 0.0,
    as_json: Json = False,
) -> None:
    """Say what a cluster costs besides its cases: time, memory and store of the command that plans them."""
    from proofroll_benchmarks.cluster import bench_cluster

    with progress_bar("cases", total=cases) as advance:
        found = bench_cluster(scheduler, cases, seconds, progress=advance)
    if as_json:
        write_json(found)
        return
    from proofroll.report.terminal import console

    each = 1e3 * found["processor"] / cases
    console().print(
        f"{cases} cases on {found['threads']} threads: {found['wall']:.1f} s, of which {found['processor']:.1f} s of "
        f"this process ({each:.2g} ms a case), {found['memory']:.0f} MB more than it began with, "
        f"{found['stored'] / cases:.0f} bytes stored a case."
    )
    if found["efficiency"] is not None:
        console().print(f"Efficiency for cases of {seconds:g} s: {found['efficiency']:.2f} a thread.")
