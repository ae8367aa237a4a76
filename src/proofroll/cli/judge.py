"""Command ``judge``: compares a trajectory from any program with the truth of a scene."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options
from proofroll.core.limits import RUN_TIME_LIMIT


def judge(
    run: Annotated[
        Path, typer.Argument(help="File (.nc, .csv, .npz) with time [s] and the state, or variables of the truth.")
    ],
    named: Annotated[str | None, typer.Argument(metavar="SCENE", help="The scene, unless --scene has it.")] = None,
    scene: Annotated[
        str | None, typer.Option(help="The scene, or the path of its folder.", autocompletion=options.scenes_like)
    ] = None,
    settings: options.Set = None,
    tolerance: Annotated[
        list[str] | None, typer.Option(help="variable='1 %' of its scale, or variable='1e-3 m'; repeat.")
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option("--map", help="Your columns: t=time,theta=q.pivot[deg],x=tip.x[cm]; units are converted."),
    ] = None,
    robot: Annotated[
        Path | None, typer.Option(help="The robot file (URDF, MJCF) of a record with actions or efforts.")
    ] = None,
    control: Annotated[Path | None, typer.Option(help="With --robot: the controller's file (.toml).")] = None,
    layout: Annotated[
        str, typer.Option("--as", help="With --robot: whose arrays: playground, isaaclab, isaacgym, legged_gym.")
    ] = "",
    because: Annotated[str, typer.Option(help="Why that is close enough.")] = "",
    time_limit: Annotated[float, typer.Option(help="Wall seconds after which the truth is given up.")] = RUN_TIME_LIMIT,
    as_json: options.Json = False,
) -> None:
    """Hold a trajectory from anywhere against the truth of a scene; exit 1 if it differs.

    With --robot and --control: test a record of a robot layer by layer, without a simulation: instants from the rate,
    observation from the state, action, target, effort, and in the air acceleration.
    """
    from proofroll.core.errors import InputError
    from proofroll.files.trajectory_file import CSV, NETCDF, STORED

    if named is not None and run.suffix not in (NETCDF, CSV, STORED) and Path(named).suffix in (NETCDF, CSV, STORED):
        run, named = Path(named), str(run)
    if not run.exists():  # answered before more is imported
        either = f", and {named} is none either" if named and not Path(named).is_file() else ""
        raise InputError("run", run, f"there is no such file{either}; proofroll judge FILE SCENE")
    if robot is not None or control is not None:
        _judge_record(run, robot, control, _names(columns), layout, as_json=as_json)
    if layout:
        raise InputError("--as", layout, "it is for the record of a robot: give --robot and --control, too")
    from proofroll.files.scene_file import load_scene
    from proofroll.studies.judging import judge as judging

    written: Mapping[str, object] = {}
    if named is None and scene is None:
        scene, written = _scene_of_run(run)
    if (named is None) == (not scene):
        raise InputError("scene", scene or "", "name it once: proofroll judge FILE --scene SCENE")
    loaded = load_scene(scene or str(named), **{**written, **options.assignments(settings)})  # type: ignore[arg-type]  # text is checked there
    bounds = options.assignments(tolerance, "--tolerance") if tolerance else None
    with options.spinner(f"the truth of {loaded.name}"), options.wall_limit(time_limit, f"the truth of {loaded.name}"):
        judged = judging.judge(run, loaded, bounds, because=because, columns=_names(columns))
    if as_json:
        options.write_json(judged.content())
    else:
        options.show_lines(str(judged).splitlines())
    raise typer.Exit(options.OK if judged.agrees else options.CONTRADICTED)


def _names(columns: list[str] | None) -> dict[str, str]:
    """Columns of the user's file -> their names here."""
    return options.assignments([part for text in columns or () for part in text.split(",")], "--map")


def _judge_record(
    record: Path, robot: Path | None, control: Path | None, names: Mapping[str, str], layout: str, *, as_json: bool
) -> None:
    """Judges a record of a robot under a controller, and exits."""
    from proofroll.core.errors import InputError
    from proofroll.files.scene_sources import JudgesRecords, source_of

    if robot is None or control is None:
        lacking, present = ("--robot", control) if robot is None else ("--control", robot)
        raise InputError(lacking, None, f"a record needs the robot and its controller; {present} is one of both")
    source = source_of(str(robot))
    if source is None or not isinstance(source[0], JudgesRecords):
        raise InputError("--robot", robot, "give the path of a robot file, .urdf or .xml")
    with options.spinner(f"layers of {record}"):
        judged = source[0].judge_record(record, robot, control, names, layout)
    if as_json:
        options.write_json(judged)
    else:
        options.show_lines([*judged.lines()])
    raise typer.Exit(options.CONTRADICTED if not judged.agrees else options.OK if judged.looked_at else options.ENGINE)


def _scene_of_run(run: Path) -> tuple[str, Mapping[str, object]]:
    """Scene and parameters that `proofroll run --out` wrote into a file; an empty name if there are none."""
    from proofroll.files.trajectory_file import read

    try:
        attrs = read(run).attrs
        parameters = json.loads(str(attrs.get("parameters", "{}")))
    except (OSError, ValueError):
        return "", {}
    name = str(attrs.get("scene_path", attrs.get("scene", "")))
    return name, parameters if isinstance(parameters, dict) else {}
