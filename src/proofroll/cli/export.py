"""A scene as a file of an engine's own, for its viewer and its other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli.options import SceneName, Set, assignments, require_writable, spinner


def export(
    scene: SceneName,
    file: Annotated[Path, typer.Argument(help="The file to write.")],
    engine: Annotated[str, typer.Option(help="name[key=value,…]; mujoco writes MJCF.")],
    settings: Set = None,
) -> None:
    """Write the model that an engine builds of a scene, as its own tools read it."""
    from proofroll.report.terminal import console
    from proofroll.running.model_file import model_file
    from proofroll.running.store import write_text
    from proofroll.studies.run_once import single_case

    require_writable(file)
    case = single_case(scene, assignments(settings or []), engine, until=1.0, every=1.0, time_limit=60.0)
    with spinner(f"{scene} in {case.engine.name}"):
        text = model_file(case)
    write_text(file, text)
    console().print(f"{file} is written")
