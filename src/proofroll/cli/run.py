"""Command ``run``: one run of one scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.limits import RUN_TIME_LIMIT

if TYPE_CHECKING:
    from threading import Thread

    from proofroll.report.run.run import RunContent
    from proofroll.running.case import Case
    from proofroll.running.idle_workers import Workers


def run(
    scene: options.SceneName,
    engine: Annotated[
        str,
        typer.Option(
            help="truth, or name[key=value,…], e.g. mujoco[formulation=chart,dt=1e-4].",
            autocompletion=options.runs_like,
        ),
    ],
    settings: options.Set = None,
    _root: options.Root = None,
    control: options.Control = None,
    ground: options.Ground = None,
    until: options.Until = None,
    every: Annotated[
        float | None, typer.Option(help="Interval between samples [s]; by default 0.01, or near it in whole steps.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the trajectory to this file, by its ending: nc (netCDF), csv, or npz (numpy)."),
    ] = None,
    keep: Annotated[
        str | None, typer.Option(help="Keep the run by this name: proofroll replay lists and shows what is kept.")
    ] = None,
    events: Annotated[
        Path | None, typer.Option(help="Write the events to this csv file, with energy and height of each bounce.")
    ] = None,
    time_limit: Annotated[
        float, typer.Option(help="Seconds after which the run is ended; a truth keeps what it has found.")
    ] = RUN_TIME_LIMIT,
    ask: Annotated[list[str] | None, typer.Option(help="What is wanted besides the motion: orientation.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the run to this file: html in motion beside the truth, or svg, png, pdf.")
    ] = None,
    forces: Annotated[bool, typer.Option("--forces", help="Show all forces and moments, too.")] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="Show forces, velocities, settings and all digits, too.")
    ] = False,
    matrices: Annotated[
        bool, typer.Option("--matrices", help="Show M, h and g of M v' + h + g = tau at the start, and run nothing.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Run one scene in one engine."""
    import math
    import tempfile

    from proofroll.running.forked import may_be_forked

    forked = may_be_forked()  # before anything imports numpy

    from proofroll.running.idle_workers import Workers

    settings, question, scene = (
        options.with_ground(settings, control, ground),
        scene,
        options.controlled(scene, control),
    )
    if matrices:
        _show_matrices(scene, engine, options.assignments(settings), as_json)
        return
    # One process resolves the settings and makes the run.
    workers = Workers(patience=time_limit if time_limit > 0 else math.inf)
    preparing = None if forked else _preparing(engine, workers)

    from proofroll.studies.cases import scene_of_run, single_case

    chosen, asks = options.assignments(settings), tuple(dict.fromkeys(ask or []))
    loaded = scene_of_run(scene, chosen, asks)  # a mistyped name is answered before more is imported
    preparing = preparing or _preparing(engine, workers)
    if control is not None or settings:
        options.doubt_numbers(scene, settings)

    from proofroll.core.time_grid import EVERY, time_grid
    from proofroll.files.scene_file import scene_names
    from proofroll.files.scene_sources import command_line, resolved
    from proofroll.files.trajectory_file import STORED
    from proofroll.report.run.run import run_content, run_lines
    from proofroll.report.terminal.screen import WIDTH
    from proofroll.running.runner import run_one

    if until is not None:
        time_grid(until, EVERY if every is None else every)
    trajectories = _trajectories(out, keep)
    _require_files(events, plot)
    with options.spinner(f"{scene} in {engine}"):
        preparing.join()
        case = single_case(
            scene,
            chosen,
            engine,
            until=until,
            every=every,
            time_limit=time_limit,
            asks=asks,
            workers=workers,
            loaded=loaded,
        )
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / f"run{STORED}"
        with options.spinner(f"{scene} in {case.engine.name}"):
            result = run_one(case, target, workers)
        content = run_content(case, result, target, loaded)
        if result.trajectory is not None:
            path_of_scene = {"scene_path": resolved(scene)} if scene not in scene_names() else {}
            content = _written(content, target, path_of_scene, trajectories, events=events, plot=plot)
    done = content.status == "done"
    if not done:
        options.complain(f"{content.engine} {content.status}: {content.message}{_shorter_step(scene, engine, case)}")
        for told in content.diagnosis:
            options.complain(f"{told.sentence}: {told.cause.remedy}")
    if as_json or done or content.final:
        judged = command_line("compare", question, engine=engine, set=settings, control=control, until=until)
        how = {"engine": case.engine.title, "checked": judged if engine != "truth" else ""}
        parts = partial(run_lines, content, **how, forces=forces, everything=everything)
        options.show(content, as_json, parts, widest=WIDTH)
    if not done or content.ends is not None:
        raise typer.Exit(options.ENGINE)


def _preparing(engine: str, workers: Workers) -> Thread:
    """Thread in which a worker imports the engine, while this process imports the modules that read results."""
    from threading import Thread

    from proofroll.running.engine_questions import prepare
    from proofroll.running.forked import begin_template

    begin_template()
    thread = Thread(target=prepare, args=(engine, workers), daemon=True)
    thread.start()
    return thread


def _show_matrices(scene: str, engine: str, settings: dict[str, str], as_json: bool) -> None:
    """Prints the matrices of the equations of motion at the start, of the truth or of an engine's model.

    Raises:
        InputError: the scene has no such equations.
    """
    from proofroll.core.errors import InputError
    from proofroll.report.kinds import kind_of
    from proofroll.report.run.last_values import matrix_lines
    from proofroll.running.simulation import build
    from proofroll.studies.cases import scene_of_run

    loaded = scene_of_run(scene, settings, ())
    kind = kind_of(loaded)
    built = None if engine == "truth" else build(loaded, engine).built()
    content = None if kind is None else kind.matrices(loaded, built)
    if content is None:
        raise InputError("--matrices", scene, "it is for scenes of bodies and joints; name one of these")
    options.show(content, as_json, lambda: matrix_lines(content))
    if content.M is None:
        options.complain(f"{engine} does not give the matrices of its equations")
        raise typer.Exit(options.ENGINE)


def _trajectories(out: Path | None, keep: str | None) -> list[Path]:
    """Files for the trajectory of a run. Raises InputError unless all can be written."""
    from proofroll.core.errors import InputError
    from proofroll.files.kept_runs import kept_path
    from proofroll.files.trajectory_file import CSV, NETCDF, STORED

    named = {"--keep": None if keep is None else kept_path(keep), "--out": out}
    files = {option: path for option, path in named.items() if path is not None}
    for option, path in files.items():
        options.require_writable(path, option)
        if path.suffix not in (NETCDF, CSV, STORED):  # a scene.toml would be written over
            raise InputError(option, path, f"end the name of the file in {NETCDF}, {CSV} or {STORED}")
    return list(files.values())


def _require_files(events: Path | None, plot: Path | None) -> None:
    """Raises InputError unless the files that a run is to write can be written and have an ending of their formats."""
    from proofroll.core.errors import InputError
    from proofroll.files.trajectory_file import CSV
    from proofroll.report.run.plot import require_ending

    for option, file in (("--events", events), ("--plot", plot)):
        if file is not None:
            options.require_writable(file, option)
    if events is not None and events.suffix != CSV:
        raise InputError("--events", events, f"end the name of the file in {CSV}")
    if plot is not None:
        require_ending(plot, "--plot")
        options.require_pages()


def _written(
    content: RunContent,
    stored: Path,
    attributes: dict[str, str],
    files: Sequence[Path],
    *,
    events: Path | None,
    plot: Path | None,
) -> RunContent:
    """Content with the names of the files that are written here from the ``stored`` trajectory."""
    from proofroll.files.atomic import replacing
    from proofroll.files.trajectory_file import import_xarray, read, write
    from proofroll.report.run.plot import draw_run
    from proofroll.report.run.run import event_csv

    if plot is not None or files:
        import_xarray()
    if plot is not None:
        with options.spinner("the plot, beside the truth"):
            draw_run(read(stored).assign_attrs(attributes), plot)
        content = replace(content, plot=str(plot))
    for file in files:
        write(read(stored).assign_attrs(attributes), file)
        content = replace(content, trajectory=str(file))
    if events is not None:
        with replacing(events) as temporary:
            temporary.write_text(event_csv(content))
        content = replace(content, event_table=str(events))
    return content


def _shorter_step(scene: str, engine: str, case: Case) -> str:
    """Advice to use the step that the scene's file recommends, if the run had a longer one; else empty."""
    from proofroll.core.plugins import parse_engine
    from proofroll.files.scene_file import read_scene_file

    dt, step = read_scene_file(scene).dt, case.engine.step
    if dt is None or step is None or step <= dt:
        return ""
    spec = parse_engine(engine)
    shorter = replace(spec, options={**spec.options, "dt": f"{dt:g}"})
    return f"; this scene asks for steps of {dt:g} s or less: --engine '{shorter}'"
