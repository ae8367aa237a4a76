"""What things cost: commands under ``proofroll bench``."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from proofroll.cli.common import CONTRADICTED, ENGINE, Engines, Json, progress_bar, write_json

bench = typer.Typer(help="Measure what proofroll itself costs.", no_args_is_help=True, rich_markup_mode=None)

Rounds = Annotated[int, typer.Option("--rounds", min=1, help="Measurements of each, in turns.")]


@bench.command()
def adapters(
    engine: Engines = None,
    preset: Annotated[str, typer.Option(help="Preset of each formulation that has it.")] = "matched",
    rounds: Rounds = 7,
    seconds: Annotated[float, typer.Option(min=1e-3, help="Least length of one measurement [s].")] = 0.1,
    as_json: Json = False,
) -> None:
    """Compare each adapter with the bare loop that a careful user of its engine would write."""
    from proofroll.bench.adapters import bench_adapters, content
    from proofroll.registry import engine_names, require_engine

    for name in engine or ():
        require_engine(name)
    with progress_bar("adapters") as advance:
        found = content(bench_adapters(engine or engine_names(), preset, rounds, seconds, progress=advance))
    if as_json:
        write_json(found)
    else:
        _print_adapters(found)
    measured = [item for item in found["engines"].values() if item["ratio"] is not None]
    if engine and not measured:
        raise typer.Exit(ENGINE)
    if not all(item["within_goal"] for item in measured):
        raise typer.Exit(CONTRADICTED)


@bench.command()
def study(
    engine: Engines = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Workers at once.")] = 2,
    seconds: Annotated[float, typer.Option(min=0.01, help="How long each case lasts inside its engine [s].")] = 1.0,
    as_json: Json = False,
) -> None:
    """Say what part of a study's wall time × workers is spent outside the engines, and on what."""
    from proofroll.bench.study import bench_study
    from proofroll.registry import engine_names, require_engine

    for name in engine or ():
        require_engine(name)
    with progress_bar("cases") as advance:
        found = bench_study(engine or engine_names(), jobs, seconds, progress=advance)
    if as_json:
        write_json(found)
    else:
        _print_study(found)
    if not found["within_goal"]:
        raise typer.Exit(CONTRADICTED)


def _print_study(found: dict[str, Any]) -> None:
    from rich.table import Table
    from rich.text import Text

    from proofroll.report.terminal import console, number

    title = f"{found['wall_seconds']:.1f} s with {found['jobs']} workers: {found['outside']:.0%} outside the engines"
    shares = Table(box=None, padding=(0, 2, 0, 0), title=Text(title), title_justify="left")
    shares.add_column("wall time × workers")
    shares.add_column("part", justify="right")
    for cause, share in found["shares"].items():
        shares.add_row(Text(cause), f"{share:.1%}")
    cases = Table(box=None, padding=(0, 2, 0, 0))
    for column in ("case", "f", "simulated", "wall", "outside"):
        cases.add_column(column, justify="left" if column == "case" else "right")
    for case in found["cases"]:
        outside = "–" if case["outside"] is None else f"{case['outside']:.0%}"
        resistance = "> 0" if case["parameters"] else "0"
        cases.add_row(
            Text(f"{case['engine']} {case['formulation']} ({case['status']})"),
            resistance,
            f"{case['until']:.4g} s",
            f"{case['seconds']:.2f} s",
            outside,
        )
    for table in (shares, cases):
        console().print(table)
        console().print()
    starts = ", ".join(f"{name} {number(seconds)} s" for name, seconds in found["first_answer"].items())
    console().print(f"from the start of a process to its first answer: {starts}")
    if found["load_before"] is not None:
        console().print(f"load average of the machine before: {found['load_before']:.1f}")
    console().print(f"goal: at most {found['goal']:.0%} outside")


def _print_adapters(found: dict[str, Any]) -> None:
    from rich.table import Table
    from rich.text import Text

    from proofroll.report.terminal import console

    table = Table(box=None, padding=(0, 1, 0, 0), title=Text("advance over bare loop"), title_justify="left")
    for column in ("engine formulation", "variant", "ratio", "95 %"):
        table.add_column(column, no_wrap=True)
    table.add_column("")
    for name, item in found["engines"].items():
        for row in item["rows"]:
            ratio = row["ratio"]
            interval = "" if ratio is None else f"{ratio['low']:.3f}–{ratio['high']:.3f}"
            table.add_row(
                Text(f"{name} {row['formulation']}"),
                Text(row["variant"]),
                Text("–" if ratio is None else f"{ratio['value']:.3f}", style="" if row["within_goal"] else "yellow"),
                Text(interval),
                Text(row["message"]),
            )
    console().print(table)
    console().print(f"goal: at most {found['goal']:g}")
