"""Command ``export``: writes a scene in an engine's own file format."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options
from proofroll.core.limits import TIME_LIMIT


def export(
    scene: options.SceneName,
    file: Annotated[Path, typer.Argument(help="The file to write.")],
    engine: Annotated[str, typer.Option(help="name[key=value,…]; mujoco writes MJCF.")],
    settings: options.Set = None,
    _root: options.Root = None,
) -> None:
    """Write the model that an engine builds of a scene. Its own tools read it."""
    from proofroll.running.engine_questions import model_file
    from proofroll.running.store import write_text
    from proofroll.studies.cases import single_case

    options.require_writable(file, "file")
    case = single_case(scene, options.assignments(settings), engine, until=1.0, every=1.0, time_limit=TIME_LIMIT)
    with options.spinner(f"{scene} in {case.engine.name}"):
        text = model_file(case)
    write_text(file, text)
    sys.stdout.write(f"{file} is written\n")
