"""Commands that write files of scenes and runs: ``export`` a model or a scene, ``replay`` a page of stored runs."""

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError
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
