"""Runs a case in this process, from its certificate to the file of its trajectory."""

from __future__ import annotations

import dataclasses
import gc
import statistics
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.errors import Diverged, ProofrollError, Refused, lack_behind
from proofroll.core.limits import FOR_A_TRUTH
from proofroll.core.pace import AT, PACE
from proofroll.core.plugins import plain_name
from proofroll.running.case import Case, Result, Status
from proofroll.running.identity import manifest
from proofroll.running.identity import versions as made_with
from proofroll.running.loading import changed
from proofroll.running.time_case import clean_runs

if TYPE_CHECKING:
    from proofroll.core.certificate import Line


def run(case: dict[str, Any], out: str) -> dict[str, Any]:
    """Runs a case, writes its trajectory to ``out``, and returns its result as a dictionary."""
    spent, asked = _TimeAccounts(), Case.from_dict(case)
    gc.freeze()  # exclude loaded modules from collection, which would take as long as a short case
    try:
        answer = dataclasses.asdict(_run(asked, Path(out), spent)) | {"interpreter": sys.executable}
        _require_untouched(asked.engine.name)
    finally:
        gc.collect()  # the next case of this process starts clean
        gc.freeze()  # exclude modules loaded by this case, too
    spent.on("clean-up")
    return answer | {"spent": spent.seconds, "processor": spent.processor}


def _require_untouched(engine: str) -> None:
    """Raises ProofrollError if the engine replaced code that judges it; the caller then ends the process."""
    from proofroll.running.loading import load

    if engine != "truth" and (name := changed(load(engine))):
        raise ProofrollError(f"{engine} changed {name} in its process, so nothing that was found there is believed")


def _tell(text: str) -> None:
    """Prints how far a truth has come, in a worker, whose lines are read."""
    if PACE.aloud:
        print(f"{AT}{text}", flush=True)


def _run(case: Case, out: Path, spent: _TimeAccounts) -> Result:
    from proofroll.core.certificate import first_difference
    from proofroll.core.first_steps import certificate
    from proofroll.core.multi_element import build, step_of
    from proofroll.core.time_grid import off_grid, require_whole_steps, time_grid
    from proofroll.core.whole_turns import samples_between
    from proofroll.files.trajectory_file import write
    from proofroll.running.loading import engine_and_settings, scene_of
    from proofroll.running.recording import record

    scene = scene_of(case)
    times = time_grid(case.until, case.every)
    if case.engine.name == "truth":
        counting = samples_between(scene, times) if case.turns else times[:0]
        besides = (counting, np.array(case.between), list(case.engine.steps))
        spent.on("loading")
        with PACE.limited(case.time_limit * FOR_A_TRUTH, _tell):
            return _run_truth(case, scene, times, besides, out, spent)
    kind, settings = engine_and_settings(case)
    versions = made_with(plain_name(case.engine.name), kind.version())
    spent.on("loading")
    try:
        engine = build(kind, scene, settings)
        spent.on("building")
        building = spent.seconds["building"]
        step = step_of(engine, settings)
        require_whole_steps(times, step)
        lines_of_certificate = _known_certificate(case)
        if lines_of_certificate is None:
            lines_of_certificate = certificate(kind, engine, scene, settings)
        difference = first_difference(lines_of_certificate)
        if difference is None:
            _keep_certificate(case, lines_of_certificate)
        spent.on("certificate")
        lines = [line.as_dict() for line in lines_of_certificate]
        if difference is not None:
            return Result(Status.WRONG_MODEL, difference, certificate=lines, versions=versions)
        counting = samples_between(scene, times, step) if case.turns else times[:0]
        recording = record(engine, scene, times, off_grid(times, step), counting, wants_events=not case.without_events)
        spent.on("trajectory", advance=recording.advancing, sampling=recording.sampling)
        del engine
    except (Refused, Diverged) as error:
        return _answer(error, versions)
    timings: list[float] = []
    remarks: list[str] = []
    reached = recording.columns["time"].values
    if recording.failure is None and case.timed and len(reached) > 1:
        clean = clean_runs(kind, scene, settings, recording)
        timings, remarks = clean.rates, clean.remarks
        spent.on("building", clean_runs=(clean.wall, clean.processor))
    result = Result(
        status=Status.DONE if recording.failure is None else Status.DIVERGED,
        message="; ".join([recording.message(case.until), *remarks]),
        wall_seconds=recording.wall_seconds,
        build_seconds=building,
        seconds_per_second=statistics.median(timings) if timings else None,
        timings=timings,
        certificate=lines,
        versions=versions,
        trajectory=out.name,
    )
    attrs = {"status": result.status.value, "message": result.message, "wall_seconds": result.wall_seconds}
    attrs |= manifest(case.engine.name, case.engine.settings, scene, versions, lines_of_certificate)
    write(recording.columns.assign(**attrs), out)
    spent.on("writing")
    return result


# Case without its step -> the coarsest step whose model was held against the scene [s], and the lines of that.
_certificates: dict[str, tuple[float, list[Line]]] = {}


def _without_step(case: Case) -> str:
    """Text of all that a case's model is made from, but for the step."""
    settings = {name: value for name, value in case.engine.settings.items() if name != "dt"}
    return repr((case.scene, case.scene_digest, case.asks, case.engine.name, settings))


def _known_certificate(case: Case) -> list[Line] | None:
    """Certificate of the same model with a coarser step, which held in this process; None: there is none.

    What the first steps tell differs from the scene by less with a finer step, so that it holds there, too.
    """
    coarsest, lines = _certificates.get(_without_step(case), (0.0, None))
    return lines if (step := _fixed_step(case)) and coarsest >= step else None


def _keep_certificate(case: Case, lines: list[Line]) -> None:
    """Keeps a certificate that holds for cases with finer steps."""
    coarsest, _ = _certificates.get(_without_step(case), (0.0, lines))
    if (step := _fixed_step(case)) and step >= coarsest:
        _certificates[_without_step(case)] = step, lines


def _fixed_step(case: Case) -> float:
    """Fixed step of a case [s]; 0: it adapts, or the engine has none of its own."""
    return float(case.engine.settings.get("dt") or 0.0) if case.engine.resolution == "dt" else 0.0


def _answer(error: Refused | Diverged, versions: dict[str, str]) -> Result:
    """Result for a refusal or divergence of an engine; raises ProofrollError if the machine caused it."""
    if lack := lack_behind(error):
        raise ProofrollError(f"{error} ({type(lack).__name__})")
    status = Status.REFUSED if isinstance(error, Refused) else Status.DIVERGED
    return Result(status, str(error), versions=versions)


def _run_truth(
    case: Case, scene: Any, times: Any, besides: tuple[Any, Any, Any], out: Path, spent: _TimeAccounts
) -> Result:
    from proofroll.core.dataset import truth_message
    from proofroll.core.truth import truth
    from proofroll.files.scene_sources import SeesTouches, source_of
    from proofroll.files.trajectory_file import import_xarray, write

    import_xarray()

    start, versions = time.perf_counter(), made_with("truth", case.engine.version)
    source, path = source_of(case.scene) or (None, Path())
    try:
        dataset = truth(scene, times, *besides)
        dataset = source.until_met(path, scene, dataset) if isinstance(source, SeesTouches) else dataset
    except (Refused, Diverged) as error:
        return _answer(error, versions)
    finally:
        spent.on("truth")
    wall = time.perf_counter() - start
    message = truth_message(dataset)
    attrs = {"status": "done", "message": message, "wall_seconds": wall}
    write(dataset.assign_attrs(attrs | manifest("truth", {}, scene, versions)), out)
    spent.on("writing")
    return Result(Status.DONE, message, wall_seconds=wall, versions=versions, trajectory=out.name, cut=PACE.over)


class _TimeAccounts:
    """Time of a case by activity.

    Attributes:
        seconds: activity -> wall time [s].
        processor: activity -> processor time of this process [s], which other processes do not lengthen.
    """

    _counted = 0.0  # processor time up to the end of the last case [s]; later time is start-up and other requests

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        used = time.process_time()
        self.processor: dict[str, float] = {"process start": used - _TimeAccounts._counted}
        self._since = time.perf_counter(), used

    def on(self, cause: str, **parts: tuple[float, float]) -> None:
        """Adds the time since the last call to an activity.

        Args:
            cause: the activity.
            **parts: activity -> wall and processor time of its own [s], which are taken off.
        """
        clocks = time.perf_counter(), time.process_time()
        for index, account in enumerate((self.seconds, self.processor)):
            spent = {key.replace("_", " "): part[index] for key, part in parts.items()}
            spent[cause] = clocks[index] - self._since[index] - sum(spent.values())
            for key, value in spent.items():
                account[key] = account.get(key, 0.0) + value
        self._since, _TimeAccounts._counted = clocks, clocks[1]
