"""A trajectory of anybody's against the truth of a scene."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options


def judge(
    run: Annotated[
        Path, typer.Argument(help="File (.nc, .csv, .npz) with time [s] and the state, or variables of the truth.")
    ],
    scene: Annotated[str, typer.Option(help="The scene, or the path of its folder.")],
    settings: options.Set = None,
    tolerance: Annotated[
        list[str] | None, typer.Option(help="variable='1 %' of its scale, or variable='1e-3 m'; repeat.")
    ] = None,
    because: Annotated[str, typer.Option(help="Why that is close enough.")] = "",
    as_json: options.Json = False,
) -> None:
    """Hold a trajectory from anywhere against the truth of a scene; exit 1 if it differs."""
    from proofroll.files.scene_file import load_scene
    from proofroll.studies.judging import judge as judging

    loaded = load_scene(scene, **options.assignments(settings))  # type: ignore[arg-type]  # text is checked there
    bounds = options.assignments(tolerance, "--tolerance") if tolerance else None
    with options.spinner(f"the truth of {loaded.name}"):
        judged = judging.judge(run, loaded, bounds, because=because)
    if as_json:
        options.write_json(judged.content())
    else:
        sys.stdout.write(f"{judged}\n")
    raise typer.Exit(options.OK if judged.agrees else options.CONTRADICTED)
