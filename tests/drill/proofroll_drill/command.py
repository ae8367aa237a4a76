"""Drills: what must not break anything is done on purpose."""

from __future__ import annotations

import os
import sys

import typer

from proofroll.cli.options import CONTRADICTED, OK, Json, progress_bar, write_json

drill = typer.Typer(help="Do on purpose what must not break anything.", rich_markup_mode=None)


@drill.callback()
def start() -> None:
    """Do on purpose what must not break anything."""


@drill.command()
def faults(as_json: Json = False) -> None:
    """Crash, hang, flood, interrupt and damage runs; exit 1 unless each fault costs nothing but its own case."""
    import dataclasses

    from proofroll_drill.faults import fault_drill

    with progress_bar("faults") as advance:
        rows = fault_drill(advance)
    contained = sum(row.contained for row in rows)
    if as_json:
        content = [dataclasses.asdict(row) for row in rows]
        write_json({"tried": len(rows), "contained": contained, "faults": content})
    else:
        from proofroll.report.terminal import console
        from proofroll_drill.table import drill_table

        console().print(drill_table(rows))
        console().print(f"{len(rows)} faults tried, {contained} contained.")
    if any(row.hung for row in rows):  # to end as usual would wait for the thread that hangs
        sys.stdout.flush()
        os._exit(CONTRADICTED)
    raise typer.Exit(OK if contained == len(rows) else CONTRADICTED)
