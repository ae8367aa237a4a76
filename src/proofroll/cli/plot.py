"""A person's own run as a picture."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli.options import require_writable


def plot(
    trajectory: Annotated[Path, typer.Argument(help="A netCDF file that proofroll run --out has written.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write, by its ending: html, svg, png or pdf; RUN.html by default.")
    ] = None,
) -> None:
    """Draw all variables of a run over time, with their units."""
    from proofroll.report.run_plot import draw_run, read_run, require_ending

    target = trajectory.with_suffix(".html") if out is None else out
    require_ending(target)
    require_writable(target)
    draw_run(read_run(trajectory), target)
    sys.stdout.write(f"The plot is in {target}.\n")
