"""Command ``judge``: compares a trajectory from any program with the truth of a scene."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.limits import FOR_A_TRUTH, RUN_TIME_LIMIT
from proofroll.core.pace import PACE

if TYPE_CHECKING:
    from proofroll.studies.judging.judge import Judged

_BAR = "the truth is known"  # beginning of the clause on the truth's error bar


def judge(
    run: Annotated[
        Path, typer.Argument(help="File (.nc, .csv, .npz) with time [s] and the state, or variables of the truth.")
    ],
    named: Annotated[
        str | None,
        typer.Argument(metavar="SCENE", help="The scene, unless --scene has it.", callback=options.own_first),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            help="The scene, or the path of its folder.", autocompletion=options.scenes_like, callback=options.own_first
        ),
    ] = None,
    settings: options.Set = None,
    _root: options.Root = None,
    tolerance: options.Tolerances = None,
    columns: Annotated[
        list[str] | None,
        typer.Option("--map", help="Your columns: t=time,theta=q.pivot[deg],x=tip.x[cm]; units are converted."),
    ] = None,
    robot: Annotated[
        Path | None, typer.Option(help="The robot file (URDF, MJCF) of a record with actions or efforts.")
    ] = None,
    control: Annotated[Path | None, typer.Option(help="With --robot: the controller's file (.toml), if any.")] = None,
    layout: Annotated[
        str,
        typer.Option("--as", help="With --robot: whose arrays: playground, isaaclab, isaacgym, legged_gym, pybullet."),
    ] = "",
    because: Annotated[str, typer.Option(help="Why that is close enough.")] = "",
    time_limit: Annotated[float, typer.Option(help="Wall seconds after which the truth is given up.")] = RUN_TIME_LIMIT,
    everything: Annotated[
        bool, typer.Option("--all", help="List every quantity with the truth's error bar, and what is not judged.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Hold a trajectory from anywhere against the truth. Exit 1 if it differs.

    With --robot and --control: test a record of a robot layer by layer, without a simulation: instants from the rate,
    observation from the state, action, target, effort, and in the air acceleration. Without --control: state and
    acceleration.
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
        raise InputError("--as", layout, "it is for the record of a robot: give --robot, too")
    from proofroll.files.scene_file import load_scene
    from proofroll.files.scene_sources import command_line
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.studies.judging import judge as judging

    written: Mapping[str, object] = {}
    told = scene or named
    if named is None and scene is None:
        scene, written = _scene_of_run(run)
    if (named is None) == (not scene):
        raise InputError("scene", scene or "", "name it once: proofroll judge FILE --scene SCENE")
    loaded = load_scene(scene or str(named), **{**written, **options.assignments(settings)})  # type: ignore[arg-type]  # text is checked there
    what, soft = f"the truth of {loaded.name}", PACE.limited(FOR_A_TRUTH * time_limit)
    with options.spinner(what), options.wall_limit(time_limit, what), soft:
        judged = judging.judge(run, loaded, tolerance or None, because=because, columns=_names(columns))
    if as_json:
        options.write_json(judged.content())
    else:
        seconds = time_limit if time_limit != RUN_TIME_LIMIT else None
        choices = {"set": settings, "tolerance": tolerance, "because": because, "time_limit": seconds}
        asked = command_line("judge", str(run), scene=told, **choices)
        lines = _lines(judged, run.name, asked, _names(columns), everything=everything)
        options.show_lines(lines, widest=WIDTH)
    raise typer.Exit(options.OK if judged.agrees else options.CONTRADICTED)


def _lines(judged: Judged, file: str, asked: str, names: Mapping[str, str], *, everything: bool) -> Iterator[str]:
    """Answer with its cause, the worst quantity of each kind, and the command that closes a cause; or all of it."""
    from proofroll.studies.judging.causes import mapping
    from proofroll.studies.judging.user_trajectory import FROM_STATE

    sign, verb = ("✓", "agrees with") if judged.agrees else ("✗", "differs from")
    _, *rest = str(judged).splitlines()
    cause = f": {judged.causes[0].partition(' (')[0]}" if judged.causes else ""
    because = f" (tolerance: {judged.because})" if judged.because else ""
    yield f"{sign} {file} {verb} the truth of {judged.scene}{because}{cause}"
    yield ""
    kinds: dict[str, str] = {}
    for item in judged.compared:
        if everything or item.agrees is judged.agrees:
            text = "; ".join(part for part in str(item).split("; ") if everything or not part.startswith(_BAR))
            kind = item.judgement.observable if everything else item.judgement.unit
            kinds.setdefault(kind, f"{'✓' if item.agrees else '✗'} {text}")
    yield from kinds.values()
    yield from (f"  cause: {cause}" for cause in judged.causes)
    units = {item.judgement.observable: item.judgement.unit for item in judged.compared}
    closing = [text for cause in judged.causes for text in mapping(cause, units, names)]
    if closing:
        new = {text.partition("=")[0] for text in closing}
        kept = [f"{column}={name}" for column, name in names.items() if column not in new]
        yield f"Say so: {asked} --map {shlex.quote(','.join([*kept, *closing]))}"
    elif not judged.agrees and not judged.causes:
        yield "no simple cause: no other unit, sign, delay or start, no swapped columns, no sum of angles"
    further = [line.strip() for line in rest[len(judged.compared) + len(judged.causes) :]]
    yield from (line for line in further if everything or FROM_STATE not in line)
    if len(kinds) < len(judged.compared):
        yield "The nearest to its limit of each kind; all: --all." if judged.agrees else "All quantities: --all."


def _names(columns: list[str] | None) -> dict[str, str]:
    """Columns of the user's file -> their names here."""
    return options.assignments([part for text in columns or () for part in text.split(",")], "--map")


def _judge_record(
    record: Path, robot: Path | None, control: Path | None, names: Mapping[str, str], layout: str, *, as_json: bool
) -> None:
    """Judges a record of a robot, and exits."""
    from proofroll.core.errors import InputError
    from proofroll.files.scene_sources import JudgesRecords, source_of

    if robot is None:
        raise InputError("--robot", None, f"a record needs the robot beside its controller, {control}")
    source = source_of(str(robot))
    if source is None or not isinstance(source[0], JudgesRecords):
        raise InputError("--robot", robot, "give the path of a robot file, .urdf or .xml")
    with options.spinner(f"layers of {record}"):
        judged = source[0].judge_record(record, robot, control, names, layout)
    if as_json:
        options.write_json(judged)
    else:
        options.show_lines([*judged.lines()])
    answered = options.OK if judged.looked_at and judged.decided else options.ENGINE
    raise typer.Exit(answered if judged.agrees else options.CONTRADICTED)


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
