"""Benchmarks: what speed the project claims for itself, measured on this machine."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from proofroll.cli.common import Json, spinner, write_json

bench = typer.Typer(help="Measure the speed that the project claims for itself.", rich_markup_mode=None)


@bench.callback()
def start() -> None:
    """Measure the speed that the project claims for itself."""


@bench.command()
def reference(
    rounds: Annotated[int, typer.Option("--rounds", min=2, help="Measurements of each, taken in turns.")] = 5,
    as_json: Json = False,
) -> None:
    """The compiled models against the engines: how many times faster, at how large an error."""
    from proofroll.bench.reference import reference as measured

    with spinner("reference") as sign:
        content: dict[str, Any] = measured(rounds, sign.update)
    if as_json:
        write_json(content)
        return
    from proofroll.report.bench import reference_tables
    from proofroll.report.terminal import console

    out = console()
    for table in reference_tables(content):
        out.print(table)
        out.print()
