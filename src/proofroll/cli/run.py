"""One scene: a run, and the time of the first slip."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli.options import (
    CONTRADICTED,
    ENGINE,
    OK,
    Fresh,
    Jobs,
    Json,
    Out,
    SceneName,
    Set,
    assignments,
    complain,
    new_runner,
    progress_bar,
    require_writable,
    spinner,
    write_json,
)


def run(
    scene: SceneName,
    engine: Annotated[str, typer.Option(help="truth, or name[key=value,…], e.g. mujoco[formulation=chart,dt=1e-4].")],
    settings: Set = None,
    until: Annotated[float, typer.Option(help="Last time [s].")] = 2.0,
    every: Annotated[float, typer.Option(help="Interval between samples [s].")] = 0.01,
    out: Annotated[Path | None, typer.Option(help="Write the trajectory to this netCDF file.")] = None,
    time_limit: Annotated[float, typer.Option(help="Wall seconds after which the run is ended.")] = 600.0,
    ask: Annotated[list[str] | None, typer.Option(help="What is wanted besides the motion: orientation.")] = None,
    as_json: Json = False,
) -> None:
    """Run one scene in one engine."""
    import importlib
    import tempfile
    import threading

    from proofroll.report.run import run_content, run_lines
    from proofroll.running.recording import time_grid
    from proofroll.running.runner import run_one
    from proofroll.running.worker_pool import Workers
    from proofroll.studies.run_once import single_case

    time_grid(until, every)
    if out is not None:
        require_writable(out)
    # The result is read with xarray, half a second to import: done while the worker's process is busy.
    threading.Thread(target=importlib.import_module, args=("xarray",), daemon=True).start()
    workers = Workers()  # the process that tells the settings also makes the run
    case = single_case(
        scene,
        assignments(settings or []),
        engine,
        until=until,
        every=every,
        time_limit=time_limit,
        asks=tuple(dict.fromkeys(ask or [])),
        workers=workers,
    )
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "run.nc"
        with spinner(f"{scene} in {case.engine.name}"):
            result = run_one(case, target, workers)
        content = run_content(case, result, target)
        if out is not None and result.trajectory is not None:
            from proofroll.running.store import move

            move(target, out)
    if as_json:
        write_json(content)
    else:
        from proofroll.report.terminal import console

        for line in run_lines(content):
            console().print(line)
    if content["status"] != "done":
        complain(f"{content['engine']} {content['status']}: {content['message']}")
        raise typer.Exit(ENGINE)


def onset(
    scene: SceneName,
    settings: Set = None,
    engine: Annotated[list[str] | None, typer.Option(help="Engine with settings; repeat. All that can slip.")] = None,
    until: Annotated[float, typer.Option(help="How long to look for a slip [s].")] = 4.0,
    uncertainty: Annotated[float, typer.Option(help="Relative uncertainty of friction and resistance.")] = 1e-3,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Say when the ball first slips, in every engine, and how well that is posed."""
    from proofroll.elements.ball_on_surface.onset_study import onset_study, summary
    from proofroll.running.recording import time_grid

    time_grid(until, 0.01)
    with progress_bar("runs") as advance:
        study = onset_study(
            scene,
            dict(assignments(settings or [])),
            new_runner(out, fresh, jobs),
            engines=engine or (),
            until=until,
            uncertainty=uncertainty,
            progress=lambda case, _: advance(case.engine.name),
        )
    content = study.content()
    if as_json:
        write_json(content)
    else:
        from proofroll.report.terminal import console, onset_table

        console().print(summary(content), markup=False)
        console().print(onset_table(content))
    verdicts = {item["verdict"] for item in content["engines"]}
    # A refusal is an answer where nobody asked for that engine in particular.
    if "failed" in verdicts or (engine and "refused" in verdicts):
        raise typer.Exit(ENGINE)
    raise typer.Exit(CONTRADICTED if "disagree" in verdicts else OK)
