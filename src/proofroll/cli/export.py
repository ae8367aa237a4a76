"""Command ``export``: writes a scene in an engine's own file format, or that of a robot file as a scene's own."""

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from proofroll.cli import options
from proofroll.core.limits import TIME_LIMIT


def export(
    scene: options.SceneName,
    file: Annotated[Path, typer.Argument(help="The file to write.")],
    engine: Annotated[str | None, typer.Option(help="name[key=value,…]; mujoco writes MJCF.")] = None,
    kind: Annotated[
        Literal["scene"] | None,
        typer.Option("--as", help="Instead of a model, the scene.toml of a robot file (URDF, MJCF), to be added to."),
    ] = None,
    control: options.Control = None,
    ground: options.Ground = None,
    settings: options.Set = None,
    _root: options.Root = None,
) -> None:
    """Write an engine's model of a scene; or a robot as a scene.

    With --as scene FILE is the scene's new folder, or the path of its scene.toml.
    """
    from proofroll.core.errors import InputError
    from proofroll.files.scene_file import scene_text
    from proofroll.running.engine_questions import model_file
    from proofroll.running.store import write_text
    from proofroll.studies.cases import single_case

    settings, scene = options.with_ground(settings, control, ground), options.controlled(scene, control)
    if (engine is None) == (kind is None):
        raise InputError("--engine", engine, "give an engine, whose model is written, or --as scene")
    if engine is None:
        file = file if file.name == "scene.toml" else file / "scene.toml"
        write_text(file, scene_text(scene, options.assignments(settings)))
        sys.stdout.write(f"{file} is written\n")
        return
    options.require_writable(file, "file")
    case = single_case(scene, options.assignments(settings), engine, until=1.0, every=1.0, time_limit=TIME_LIMIT)
    with options.spinner(f"{scene} in {case.engine.name}"):
        text = model_file(case)
    write_text(file, text)
    sys.stdout.write(f"{file} is written\n")
