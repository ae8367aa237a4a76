"""The process in which engines run: one request a line on standard input, one answer a line on a private pipe.

``python -m proofroll.worker FD PARENT`` serves requests until its input ends. What an engine prints cannot reach the
answers, and what an engine breaks costs only this process.
"""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import hashlib
import inspect
import json
import os
import platform
import statistics
import sys
import threading
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import proofroll
from proofroll.case import Case, EngineFacts, Result, Status
from proofroll.errors import Diverged, InputError, Missing, ProofrollError, Refused
from proofroll.memory import volunteer

# Everything whose change may change a result; reports and command line are not among it.
_FOUNDATION = (
    "case.py",
    "certificate.py",
    "closed_form.py",
    "compiled/library.py",
    "compiled/projection.py",
    "compiled/rolling.py",
    "compiled/series.py",
    "engine.py",
    "events.py",
    "mechanics.py",
    "motion.py",
    "recording.py",
    "resting.py",
    "rolling_equations.py",
    "scene.py",
    "scene_file.py",
    "surfaces.py",
    "toml_file.py",
    "trajectory.py",
    "worker.py",
)
# A clean run shorter than this is repeated, up to three times, so that its median means something.
_TIMED_SECONDS = 0.2
_TIMED_RUNS = 3
_ENOUGH_SECONDS = 0.3
# A measurement builds a short case again and again until it has run long enough to mean something, but all of it, the
# builds included, may last no more than this many times as long.
_MOST_BUILDING = 5.0


def main(answers: int, parent: int) -> None:
    """Serves requests; ``answers`` is the file descriptor for the answers, ``parent`` the process that asks."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    volunteer()
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)  # an engine that asks its user something must not read the next request
    with os.fdopen(answers, "w", encoding="utf-8") as pipe, requests:
        for line in requests:
            request = json.loads(line)
            number = request.pop("number")
            pipe.write(json.dumps({**_answer(request), "number": number}) + "\n")
            pipe.flush()


def _end_with(parent: int) -> None:
    """Ends this process when its parent is gone, even in the middle of a case."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    actions: dict[str, Callable[..., dict[str, Any]]] = {
        "describe": describe,
        "resolve": resolve,
        "run": run,
        "time": time_once,
        "reproduce": reproduce,
        "bench": bench,
    }
    action = actions[request.pop("do")]
    try:
        return action(**request)
    except InputError as error:
        value = error.value if isinstance(error.value, (bool, int, float, str)) else str(error.value)
        return {"error": "input", "field": error.field, "value": value, "advice": error.advice}
    except Missing as error:
        return {"error": "missing", "message": str(error)}
    except ProofrollError as error:  # a full disk, say
        return {"error": "crashed", "message": str(error)}
    except Exception as error:
        return {"error": "crashed", "message": one_line(error)}


def describe(engine: str) -> dict[str, Any]:
    """What an engine is and provides, and where its formulations stand on the ladder of models."""
    from proofroll.engine import CannotLeaveOut, TellsLevels
    from proofroll.registry import load_engine

    kind = load_engine(engine)
    presets = {
        formulation: {preset: dataclasses.asdict(settings) for preset, settings in by_preset.items()}
        for formulation, by_preset in kind.presets.items()
    }
    return {
        "name": engine,
        "version": kind.version(),
        "provides": sorted(kind.provides),
        "presets": presets,
        "summary": (inspect.getdoc(kind) or "").split("\n", 1)[0],
        "levels": dict(kind.levels) if isinstance(kind, TellsLevels) else {},
        "terms": [dataclasses.asdict(term) for term in kind.terms] if isinstance(kind, TellsLevels) else [],
        "inherent": {key: dict(terms) for key, terms in kind.inherent.items()}
        if isinstance(kind, CannotLeaveOut)
        else {},
    }


def resolve(engine: str, options: dict[str, Any]) -> dict[str, Any]:
    """Complete settings of an engine, and what else decides its results."""
    if engine == "truth":
        if options:
            raise InputError("truth", ", ".join(options), "the truth has no settings; leave them out")
        code = _digest([Path(proofroll.__file__).parent / "truth"])
        return dataclasses.asdict(EngineFacts("truth", _truth_version(), code, {}))
    from proofroll.registry import load_engine, resolve_settings

    kind = load_engine(engine)
    settings = resolve_settings(kind, options)
    source = Path(inspect.getfile(kind))
    package = (source.parent / "__init__.py").is_file() and source.parent.name != "engines"
    facts = EngineFacts(
        name=engine,
        version=kind.version(),
        code=_digest([source.parent if package else source]),
        settings=dataclasses.asdict(settings),
        resolution=settings.resolution,
        order=settings.order,
    )
    return dataclasses.asdict(facts)


def _truth_version() -> str:
    """Of proofroll, and of the libraries by which the truth is integrated."""
    found = [f"proofroll {proofroll.__version__}"]
    for name in ("numpy", "scipy", "heyoka"):
        with contextlib.suppress(metadata.PackageNotFoundError):
            found.append(f"{name} {metadata.version(name)}")
    return ", ".join(found)


def _digest(sources: list[Path]) -> str:
    """Hash of the adapter's files and of the modules that every result rests on.

    A module or folder ``reproducer`` of an adapter is left out: it writes bug reports, on which no result hangs.
    """
    root = Path(proofroll.__file__).parent
    files = [root / name for name in _FOUNDATION if (root / name).is_file()]
    for source in sources:
        if not source.is_dir():
            files.append(source)
            continue
        for file in sorted(source.rglob("*.py")):
            if "reproducer" not in file.relative_to(source).with_suffix("").parts:
                files.append(file)
    content = hashlib.sha256()
    for file in files:
        content.update(file.read_bytes())
    return content.hexdigest()[:16]


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


class Spent:
    """Where the time of a case goes.

    Attributes:
        seconds: wall seconds by cause [s].
        processor: seconds of this process by cause [s], whoever else computes on the machine.
    """

    _counted = 0.0  # of the processor, in the cases before: what has passed since was the start, and other requests

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        now = time.process_time()
        self.processor: dict[str, float] = {"process start": now - Spent._counted}
        self._since = time.perf_counter(), now

    def on(self, cause: str, **parts: tuple[float, float]) -> None:
        """What has passed since the last call went to ``cause``, but for ``parts`` of it that had another.

        Each part is a pair of wall and processor seconds [s].
        """
        now = time.perf_counter(), time.process_time()
        for index, account in enumerate((self.seconds, self.processor)):
            found = {key.replace("_", " "): part[index] for key, part in parts.items()}
            found[cause] = now[index] - self._since[index] - sum(found.values())
            for key, value in found.items():
                account[key] = account.get(key, 0.0) + value
        self._since, Spent._counted = now, now[1]


def _run(case: Case, out: Path, spent: Spent) -> Result:
    from proofroll.certificate import certify, first_difference
    from proofroll.recording import record, time_grid
    from proofroll.registry import load_engine, resolve_settings
    from proofroll.scene_file import load_scene
    from proofroll.trajectory import write

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
    lacking = scene.requires - kind.provides
    if lacking:
        return Result(Status.REFUSED, "needs " + ", ".join(sorted(lacking)), versions=versions)
    try:
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
        timings, inside = _clean_runs(kind, scene, settings, times)
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
    from proofroll.trajectory import write
    from proofroll.truth import truth

    start = time.perf_counter()
    try:
        if case.asks:
            raise Refused(f"the truth is that of the motion and gives no {', '.join(case.asks)}; ask an engine for it")
        dataset = truth(scene, times)
    except Refused as error:
        return Result(Status.REFUSED, str(error), versions=versions)
    except Diverged as error:
        return Result(Status.DIVERGED, str(error), versions=versions)
    wall = time.perf_counter() - start
    message = f"{dataset.attrs['route']}, checked by {dataset.attrs['second_route']}"
    if "sticking" in dataset:
        from proofroll.truth.onset import onset

        dataset.attrs["onset"] = json.dumps(dataclasses.asdict(onset(scene, float(times[-1]))))
    write(dataset.assign_attrs(status="done", message=message, engine="truth", wall_seconds=wall), out)
    return Result(Status.DONE, message, wall_seconds=wall, versions=versions, trajectory=out.name)


def time_once(case: dict[str, Any], seconds: float) -> dict[str, Any]:
    """One measurement of a case's speed: clean runs for about this many wall seconds, one after another."""
    from proofroll.recording import time_grid
    from proofroll.registry import load_engine, resolve_settings
    from proofroll.scene_file import load_scene

    wanted = Case.from_dict(case)
    kind = load_engine(wanted.engine.name)
    settings = resolve_settings(kind, wanted.engine.settings)
    scene = load_scene(wanted.scene, asks=wanted.asks, **wanted.parameters)
    times = time_grid(wanted.until, wanted.every)
    elapsed = simulated = 0.0
    start = time.perf_counter()
    while elapsed < seconds and time.perf_counter() - start < _MOST_BUILDING * seconds:
        try:
            wall, t = _clean_run(kind.build(scene, settings), times, seconds - elapsed)
        except (Refused, Diverged) as error:
            return {"seconds_per_second": None, "message": str(error)}
        elapsed, simulated = elapsed + wall, simulated + t
    return {"seconds_per_second": elapsed / simulated, "message": f"{simulated:g} s simulated"}


def reproduce(case: dict[str, Any]) -> dict[str, Any]:
    """The engine's own program for a case, or why there is none."""
    from proofroll.engine import Reproduces
    from proofroll.registry import load_engine, resolve_settings
    from proofroll.scene_file import load_scene

    wanted = Case.from_dict(case)
    kind = load_engine(wanted.engine.name)
    if not isinstance(kind, Reproduces):
        return {
            "program": None,
            "message": f"{wanted.engine.name} offers no program of its own",
        }
    try:
        settings = resolve_settings(kind, wanted.engine.settings)
        program = kind.reproducer(load_scene(wanted.scene, **wanted.parameters), settings)
    except Refused as error:
        return {"program": None, "message": str(error)}
    return {"program": program, "message": ""}


def bench(**what: Any) -> dict[str, Any]:
    """An adapter against a bare loop; see :func:`proofroll.bench.adapters.measure_adapter`."""
    from proofroll.bench.adapters import measure_adapter

    gc.freeze()  # modules need not be looked at again in every collection
    try:
        return measure_adapter(**what)
    except (Refused, Diverged) as error:
        return {"message": str(error)}


def _clean_runs(kind: Any, scene: Any, settings: Any, times: Any) -> tuple[list[float], tuple[float, float]]:
    """Wall seconds per simulated second of runs that only advance, each on an engine built for it.

    Besides, wall and processor seconds of all.
    """
    rates: list[float] = []
    spent = processor = 0.0
    while len(rates) < _TIMED_RUNS and spent < _TIMED_SECONDS:
        engine, before = kind.build(scene, settings), time.process_time()
        wall, t = _clean_run(engine, times, _ENOUGH_SECONDS)
        processor += time.process_time() - before
        rates.append(wall / t)
        spent += wall
    return rates, (spent, processor)


def _clean_run(engine: Any, times: Any, enough: float) -> tuple[float, float]:
    """Wall seconds and simulated seconds of a run that only advances.

    It stops where the sampled run stopped, for an adaptive step that may run past a sample is another, cheaper one;
    and it ends when ``enough`` wall seconds are over, which measure a rate as well as ten times as many do.
    """
    clock = time.perf_counter
    start = clock()
    for t in times[1:].tolist():
        engine.advance(t)
        if clock() - start > enough:
            break
    return clock() - start, t


def one_line(error: BaseException) -> str:
    """Kind and text of an exception in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}"[:400] if text else type(error).__name__


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
