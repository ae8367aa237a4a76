"""Drills: faults on purpose, other arithmetic, and a referee."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli.options import CONTRADICTED, OK, Json, Scheduler, complain, new_cluster, progress_bar, show

drill = typer.Typer(help="Do on purpose what must not break anything.", rich_markup_mode=None)


@drill.callback()
def start() -> None:
    """Do on purpose what must not break anything."""


@drill.command()
def faults(as_json: Json = False) -> None:
    """Crash, hang, flood, interrupt and damage runs; exit 1 unless each fault costs nothing but its own case."""
    from proofroll_drill.faults import fault_drill
    from proofroll_drill.table import drill_table

    with progress_bar("faults") as advance:
        rows = fault_drill(advance)
    contained = sum(row.contained for row in rows)
    content = {"tried": len(rows), "contained": contained, "faults": rows}
    show(content, as_json, lambda: [drill_table(rows), f"{len(rows)} faults tried, {contained} contained."])
    if any(row.hung for row in rows):  # to end as usual would wait for the thread that hangs
        sys.stdout.flush()
        os._exit(CONTRADICTED)
    raise typer.Exit(OK if contained == len(rows) else CONTRADICTED)


@drill.command()
def mutants(scheduler: Scheduler = None, as_json: Json = False) -> None:
    """Run engines with one planted fault each; exit 1 unless all are detected and nine of ten named."""
    from proofroll_drill.mutants.drilling import ENOUGH, mutant_drill
    from proofroll_drill.mutants.drilling import mutants as all_mutants
    from proofroll_drill.table import mutant_table

    with progress_bar("mutants", total=len(all_mutants())) as advance:
        rows = list(mutant_drill(advance, new_cluster(scheduler)))
    detected, named = sum(row.detected for row in rows), sum(row.named for row in rows)
    content = {"tried": len(rows), "detected": detected, "named": named, "mutants": rows}
    said = f"{len(rows)} mutants tried, {detected} detected, {named} named."
    show(content, as_json, lambda: [mutant_table(rows), said])
    raise typer.Exit(OK if detected == len(rows) and named >= ENOUGH * len(rows) else CONTRADICTED)


@drill.command()
def referee(
    first: Annotated[int, typer.Option(help="Number of the first random mechanism, ball or scene of contacts.")] = 0,
    count: Annotated[int, typer.Option(help="How many.", min=1)] = 20,
    balls: Annotated[bool, typer.Option("--balls", help="Balls instead of mechanisms.")] = False,
    contacts: Annotated[bool, typer.Option("--contacts", help="Bodies that touch instead of mechanisms.")] = False,
    as_json: Json = False,
) -> None:
    """Hold truths of random mechanisms, balls or contacts against other solvers; exit 1 on an error beyond its bar.

    Each has its line as soon as it is held; with --json on standard error.
    """
    from proofroll.core.errors import InputError
    from proofroll_drill.referee.holding import hold, hold_ball, hold_contacts

    if balls and contacts:
        raise InputError("--contacts", "with --balls", "give one of them")
    kind, held = ("contacts", hold_contacts) if contacts else ("balls", hold_ball) if balls else ("mechanisms", hold)
    rows, say = [], complain if as_json else typer.echo
    for seed in range(first, first + count):
        rows.append(held(seed))
        say(rows[-1].text)
    sound = sum(row.sound for row in rows)
    content = {"tried": len(rows), "sound": sound, kind: rows}
    show(content, as_json, lambda: [f"{len(rows)} {kind} tried, {sound} sound."])
    raise typer.Exit(OK if sound == len(rows) else CONTRADICTED)


@drill.command()
def robots(
    folders: Annotated[list[Path], typer.Argument(help="Folders that hold robot files and all that these name.")],
    every: Annotated[int, typer.Option(min=1, help="Check every n-th file of each folder.")] = 1,
    states: Annotated[int, typer.Option(min=1, help="Random states that are compared.")] = 5,
    as_json: Json = False,
) -> None:
    """Check all robot files in folders, those of other packages say; exit 1 if one breaks the check."""
    from proofroll_drill.robot_files import checked_files, lines, outcome_table

    with progress_bar("files") as advance:
        found = list(checked_files(folders, every, states, advance))
    show({"files": found}, as_json, lambda: [outcome_table(found), *lines(found)])
    raise typer.Exit(CONTRADICTED if any(item.outcome == "traceback" for item in found) else OK)


@drill.command()
def arithmetic(
    comparison: Annotated[
        list[str] | None, typer.Argument(help="Comparisons, studies or ladder:SCENE; by default all.")
    ] = None,
    kind: Annotated[list[str] | None, typer.Option(help="Kind of arithmetic, may be repeated; by default all.")] = None,
    tests: Annotated[str, typer.Option(help="Run tests too: quick, sensitive, nightly or all.")] = "",
    comparisons: Annotated[bool, typer.Option(help="Run comparisons.")] = True,
    out: Annotated[Path | None, typer.Option(help="Keep what was found here, a folder for each kind.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Workers at once.")] = 1,
    as_json: Json = False,
) -> None:
    """Compute as other processors do: other kernels, instructions, threads, Pythons; exit 1 if a decision differs."""
    from proofroll.core.errors import require_known
    from proofroll.files.comparison_file import load_comparison
    from proofroll_drill.arithmetic.kinds import kinds
    from proofroll_drill.arithmetic.matrix import TESTS, comparison_files, matrix
    from proofroll_drill.arithmetic.studies import is_study
    from proofroll_drill.table import arithmetic_lines, arithmetic_table

    known = {item.name: item for item in kinds()}
    for name in kind or ():
        require_known("--kind", name, known, "there are")
    if tests:
        require_known("--tests", tests, TESTS, "there are")
    asked = [item for item in known.values() if not kind or item.name in kind]
    files = (comparison or comparison_files()) if comparisons else []
    for name in comparison or ():
        if not is_study(name):
            load_comparison(name)
    if files and asked[0].name != "reference":  # decisions are held against those of this machine
        asked.insert(0, known["reference"])
    with progress_bar("arithmetic", total=len(asked)) as advance:
        found = matrix(asked, files, tests, out, jobs, advance)
    show({"arithmetic": found}, as_json, lambda: [arithmetic_table(found), *arithmetic_lines(found)])
    raise typer.Exit(OK if all(item.same for item in found) else CONTRADICTED)


@drill.command()
def published(
    scenes: Annotated[
        list[str] | None, typer.Argument(help="Scenes; by default all of which there are numbers.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Hold truths and errors of engines against numbers that were found elsewhere; exit 1 if a true value misses.

    Each number has its line as soon as it is held.
    """
    from proofroll_drill.published import held

    rows = []
    for row in held(scenes or []):
        rows.append(row)
        if not as_json:
            typer.echo(row.text)
    missed = sum(row.misses for row in rows)
    said = f"{len(rows)} numbers held, {missed} missed."
    show({"held": len(rows), "missed": missed, "numbers": rows}, as_json, lambda: [said])
    raise typer.Exit(CONTRADICTED if any(row.misses and row.kind == "value" for row in rows) else OK)
