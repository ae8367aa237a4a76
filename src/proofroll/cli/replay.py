"""Command ``replay``: runs in motion, and the list of those that are kept."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError


def replay(
    runs: Annotated[
        list[str] | None,
        typer.Argument(
            help="Files of proofroll run --out or of a report, or names of run --keep; without one, a list."
        ),
    ] = None,
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
    """Show stored runs beside the truth as a page, or list them.

    Several runs of one scene are shown together, at the instants that all have. Below are the curves of the first, as
    with `proofroll run --plot`. Without a name, the runs that are kept are listed.
    """
    from proofroll.files.kept_runs import kept_lines, run_file
    from proofroll.report.run.plot import read_run
    from proofroll.report.run.replay import replay_page
    from proofroll.running.store import write_text

    if not runs:
        sys.stdout.write("\n".join([*kept_lines(), ""]))
        return
    trajectory, *others = (run_file(name) for name in runs)
    target = trajectory.parent / f"{trajectory.stem}-replay.html" if out is None else out
    if target.suffix.lower() != ".html":
        raise InputError("--out", target, "a replay is a page: end the name of the file in .html")
    if control is not None and scene is None:
        raise InputError("--control", control, "name its robot file, too, by --scene; without both the run says them")
    scene = scene if scene is None else options.controlled(scene, control)
    options.require_writable(target)
    options.require_pages()
    run, *beside = (read_run(path) for path in (trajectory, *others))
    with options.spinner("the truth"):
        text = replay_page(trajectory, run, scene, beside)
    write_text(target, text)
    sys.stdout.write(f"The replay is in {target}.\n")
