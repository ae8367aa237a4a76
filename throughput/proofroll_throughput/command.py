"""Command ``throughput``: many copies of a scene in engines, their errors against their cost."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll import InputError
from proofroll.cli import options

if TYPE_CHECKING:
    from rich.table import Table

    from proofroll_throughput.study import Throughput


def throughput(
    scene: options.SceneName,
    vary: Annotated[str, typer.Option(help="Range of a parameter, e.g. angle=0.5:2.5")],
    copies: Annotated[str, typer.Option(help="Numbers of copies.")] = "1,16,256",
    engine: Annotated[
        list[str] | None,
        typer.Option(help="Engine, e.g. mjx[integrator=RK4]; repeat.", autocompletion=options.engines_like),
    ] = None,
    step: Annotated[list[float] | None, typer.Option(help="Fixed step [s]; repeat.")] = None,
    settings: options.Set = None,
    _root: options.Root = None,
    until: Annotated[float | None, typer.Option(help="Last time [s]; by default as of proofroll run.")] = None,
    every: Annotated[float | None, typer.Option(help="Interval between judged samples [s].")] = None,
    quantity: Annotated[str | None, typer.Option(help="Observable of the errors, e.g. q.elbow.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw error against speed to this file: svg, png, pdf.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the stored truths.")] = Path("out"),
    as_json: options.Json = False,
) -> None:
    """Move many copies of a scene; show worst error and cost. Each copy has its own truth; costs are processor time."""
    from proofroll_throughput.picture import draw, require_picture
    from proofroll_throughput.study import Question, make_throughput
    from proofroll_throughput.variation import counts_of, variation_of

    chosen = options.assignments(settings)
    steps = tuple(dict.fromkeys(step or ()))
    if any(not 0 < size < float("inf") for size in steps):
        raise InputError("--step", next(size for size in steps if not 0 < size < float("inf")), "give a step above 0 s")
    if plot is not None:
        require_picture(plot)
    asked = Question(
        scene=scene,
        settings=chosen,
        variation=variation_of(vary, scene, chosen),
        copies=counts_of(copies),
        engines=tuple(dict.fromkeys(engine or ())),
        steps=steps,
        until=until,
        every=every,
        quantity=quantity,
    )
    runner = options.new_runner(out, fresh=False, jobs=None)
    with options.progress_bar("truths") as advance:
        result = make_throughput(asked, runner, advance)
    if plot is not None:
        draw(result, plot)
    options.show(result, as_json, lambda: _parts(result, plot))
    if not any(row.worst is not None for row in result.rows):
        for row in result.rows:
            options.complain(f"{row.name}: {row.message}")
        raise typer.Exit(options.ENGINE)


def _parts(result: Throughput, plot: Path | None) -> Iterator[Table | str]:
    from proofroll_throughput.table import closing_lines, heading, table_of

    yield heading(result)
    yield table_of(result)
    yield from closing_lines(result)
    if plot is not None:
        yield f"\n{plot}"
