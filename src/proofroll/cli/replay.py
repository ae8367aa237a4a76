"""Command ``replay``: a run in motion."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError


def replay(
    trajectory: Annotated[Path, typer.Argument(help="A file of proofroll run --out, or one of a report.")],
    out: Annotated[Path | None, typer.Option(help="Page to write; RUN-replay.html by default.")] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            help="The scene, or the path of its folder; by default where it lay at the run.", callback=options.own_first
        ),
    ] = None,
    control: options.Control = None,
    _root: options.Root = None,
) -> None:
    """Show a stored run in motion beside the truth, as a page.

    Below are its curves, as with `proofroll run --plot`.
    """
    from proofroll.report.run.plot import read_run
    from proofroll.report.run.replay import replay_page
    from proofroll.running.store import write_text

    target = trajectory.parent / f"{trajectory.stem}-replay.html" if out is None else out
    if target.suffix.lower() != ".html":
        raise InputError("--out", target, "a replay is a page: end the name of the file in .html")
    if control is not None and scene is None:
        raise InputError("--control", control, "name its robot file, too, by --scene; without both the run says them")
    scene = scene if scene is None else options.controlled(scene, control)
    options.require_writable(target)
    options.require_pages()
    run = read_run(trajectory)
    with options.spinner("the truth"):
        text = replay_page(trajectory, run, scene)
    write_text(target, text)
    sys.stdout.write(f"The replay is in {target}.\n")
