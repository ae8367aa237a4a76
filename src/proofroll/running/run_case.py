"""Runs a case in this process, from its certificate to its file."""

from __future__ import annotations

import dataclasses
import gc
import json
import platform
import statistics
import time
from pathlib import Path
from typing import Any

import proofroll
from proofroll.core.errors import Diverged, Refused
from proofroll.running.case import Case, Result, Status
from proofroll.running.time_accounts import Spent
from proofroll.running.time_case import clean_runs


def run(case: dict[str, Any], out: str) -> dict[str, Any]:
    """Runs a case and writes its trajectory to ``out``; everything the case says comes back as a result."""
    spent = Spent()
    try:
        answer = dataclasses.asdict(_run(Case.from_dict(case), Path(out), spent))
    finally:
        gc.collect()  # the next case of this process starts clean,
        gc.freeze()  # and need not look again at what stays: the modules
    spent.on("clean-up")
    return answer | {"spent": spent.seconds, "processor": spent.processor}


def _run(case: Case, out: Path, spent: Spent) -> Result:
    from proofroll.core.certificate import certify, first_difference
    from proofroll.core.engine import require_provided
    from proofroll.core.plugins import load_engine, resolve_settings
    from proofroll.core.time_grid import time_grid
    from proofroll.files.netcdf import write
    from proofroll.files.scene_file import load_scene
    from proofroll.running.recording import record

    versions = {case.engine.name: case.engine.version, "proofroll": proofroll.__version__}
    versions["python"] = platform.python_version()
    scene = load_scene(case.scene, asks=case.asks, **case.parameters)
    times = time_grid(case.until, case.every)
    if case.engine.name == "truth":
        spent.on("loading")
        return _run_truth(case, scene, times, out, versions)
    kind = load_engine(case.engine.name)
    settings = resolve_settings(kind, case.engine.settings)
    spent.on("loading")
    try:
        require_provided(kind, settings.formulation, scene)
        engine = kind.build(scene, settings)
        spent.on("building")
        certificate = certify(engine, scene)
        difference = first_difference(certificate)
        spent.on("certificate")
        lines = [{**dataclasses.asdict(line), "holds": line.holds} for line in certificate]
        if difference is not None:
            return Result(Status.REFUSED, difference, certificate=lines, versions=versions)
        recording = record(engine, scene, times)
        spent.on("trajectory", advance=recording.advancing, sampling=recording.sampling)
        del engine
    except Refused as error:
        return Result(Status.REFUSED, str(error), versions=versions)
    except Diverged as error:
        return Result(Status.DIVERGED, str(error), versions=versions)
    timings: list[float] = []
    if recording.failure is None and case.timed and case.until > 0:
        timings, inside = clean_runs(kind, scene, settings, times)
        spent.on("building", clean_runs=inside)
    result = Result(
        status=Status.DONE if recording.failure is None else Status.DIVERGED,
        message=recording.message(case.until),
        wall_seconds=recording.wall_seconds,
        seconds_per_second=statistics.median(timings) if timings else None,
        timings=timings,
        certificate=lines,
        versions=versions,
        trajectory=out.name,
    )
    manifest = {"status": result.status.value, "message": result.message, "wall_seconds": result.wall_seconds}
    manifest |= {"engine": case.engine.name, "settings": json.dumps(case.engine.settings, sort_keys=True)}
    manifest |= {"parameters": json.dumps(dict(scene.parameters)), "versions": json.dumps(versions)}
    manifest |= {"machine": f"{platform.machine()} {platform.system()}"}
    write(recording.dataset.assign_attrs(manifest), out)
    spent.on("writing")
    return result


def _run_truth(case: Case, scene: Any, times: Any, out: Path, versions: dict[str, str]) -> Result:
    from proofroll.core.truth import truth
    from proofroll.files.netcdf import write

    start = time.perf_counter()
    try:
        dataset = truth(scene, times)
    except Refused as error:
        return Result(Status.REFUSED, str(error), versions=versions)
    except Diverged as error:
        return Result(Status.DIVERGED, str(error), versions=versions)
    wall = time.perf_counter() - start
    message = f"{dataset.attrs['route']}, checked by {dataset.attrs['second_route']}"
    write(dataset.assign_attrs(status="done", message=message, engine="truth", wall_seconds=wall), out)
    return Result(Status.DONE, message, wall_seconds=wall, versions=versions, trajectory=out.name)
