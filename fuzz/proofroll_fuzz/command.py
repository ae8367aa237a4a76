"""Command ``fuzz``: random scenes in which an engine is held against the truth."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll import InputError
from proofroll.cli import options

if TYPE_CHECKING:
    from rich.table import Table

    from proofroll_fuzz.hunt import FoundKind, Hunt

_LONGEST = 300  # characters of a message in the table


def seed_of(text: str) -> int:
    """Seed that a whole number is, or that a date YYYY-MM-DD stands for: dates a day apart have no scene in common.

    Raises:
        InputError: the text is neither.
    """
    if text.isdecimal():
        return int(text)
    try:
        day = date.fromisoformat(text)
    except ValueError:
        raise InputError("--seed", text, "must be a whole number from 0 on, or a date, e.g. 2026-11-30") from None
    return int.from_bytes(hashlib.sha256(day.isoformat().encode()).digest()[:5])


def fuzz(
    engine: Annotated[
        str,
        typer.Argument(help="An engine, e.g. mujoco[formulation=joints]; or truth.", autocompletion=options.runs_like),
    ],
    minutes: Annotated[float, typer.Option(help="Processor time [min], compilation included.")] = 10.0,
    seed: Annotated[
        str,
        typer.Option(help="Seed of the first scene, or a date; the next ones follow it.", metavar="SEED"),
    ] = "0",
    family: Annotated[
        list[str] | None, typer.Option(help="Family of scenes, e.g. loop; repeat. All by default.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for scenes with a surprise; earlier hunts in it are known.")] = Path(
        "out/fuzz"
    ),
    shrink: Annotated[
        float, typer.Option(help="Processor time to shrink each new kind [s]; 0: none is. In all half of the time.")
    ] = 45.0,
    jobs: options.Jobs = None,
    as_json: options.Json = False,
) -> None:
    """Run random scenes in an engine, and list the surprises. Each is held against the truth.

    Exits with 1 if a kind is new in this folder.
    """
    from proofroll_fuzz.hunt import hunt

    first_seed = seed_of(seed)
    with options.progress_bar("scenes") as advance:
        result = hunt(
            engine,
            out,
            minutes=minutes,
            seed=first_seed,
            families=tuple(family or ()),
            shrink=shrink,
            jobs=jobs,
            progress=lambda current: advance(f"{len(current.kinds)} kinds of surprises, {current.new} new; scenes"),
        )
    options.show(result, as_json, lambda: _parts(result))
    if result.interrupted:
        raise typer.Exit(options.INTERRUPTED)
    raise typer.Exit(options.CONTRADICTED if result.new else options.OK)


def _parts(result: Hunt) -> Iterator[Table | str]:
    from rich.table import Table
    from rich.text import Text

    last = result.first_seed + max(result.drawn, 1) - 1
    yield f"{result.engine}: {result.run} random scenes, seeds {result.first_seed} to {last}, {result.seconds:.0f} s"
    if result.unfit:
        yield f"{result.unfit} further scenes need what no formulation of {result.engine} provides."
    if result.invalid:
        yield f"{len(result.invalid)} scenes were refused by the reader: seeds {', '.join(map(str, result.invalid))}"
    if not result.kinds:
        yield "No surprise."
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("", "kind", "scenes", "seed", "tables"):
        table.add_column(heading, justify="right" if heading in {"scenes", "seed", "tables"} else "left")
    for item in result.kinds:
        sign = "new" if item.new else "finding" if item.finding else ""
        tables = str(item.smallest.tables) if item.smallest else ""
        table.add_row(sign, Text(item.kind), str(item.count), str(item.seed), tables)
    yield table
    for item in result.kinds:
        yield ""
        yield Text(f"{item.kind}: {item.largest.message[:_LONGEST]}")  # type: ignore[misc]  # a renderable, too
        yield from (f"  {line}" for line in _places(item))
    first = result.kinds[0]
    yield f"\nShow one again: proofroll compare {first.smallest.folder if first.smallest else first.folder}"


def _places(item: FoundKind) -> Iterator[str]:
    """Lines with the finding and the files of a kind."""
    smallest = item.smallest
    if item.finding:
        yield f"known: finding {item.finding}"
    if smallest is None:
        yield f"{item.folder}/scene.toml"
        return
    yield f"{smallest.folder}/scene.toml"
    if smallest.program:
        yield smallest.program
    if smallest.nearest:
        yield f"{smallest.nearest}: {smallest.folder}/nearest/scene.toml"
