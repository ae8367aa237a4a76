"""Command ``watch``: a scene run again whenever its files change."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError, ProofrollError

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.running.idle_workers import Workers

# Engines that are run, as far as they are installed and can represent the scene.
_ENGINES = ("mujoco", "exudyn", "pinocchio")
# Interval between two looks at the files, and limit of a run [s].
_LOOK, _LIMIT = 0.3, 30.0
# Share of an interval of whole milliseconds in a run, which steps of 1, 2 and 5 ms divide.
_INTERVALS, _UNIT = 100, 0.01


def watch(
    scene: options.SceneName,
    engine: Annotated[
        list[str] | None,
        typer.Option(
            help="Only this engine: its name, or name[key=value,…]; repeat.", autocompletion=options.runs_like
        ),
    ] = None,
    settings: options.Set = None,
    _root: options.Root = None,
    control: options.Control = None,
    until: options.Until = None,
    out: Annotated[Path, typer.Option(help="Page to write, which loads itself again in a browser.")] = Path(
        "watch.html"
    ),
    once: Annotated[bool, typer.Option("--once", help="Run the scene as it is now, and end.")] = False,
) -> None:
    """Show a scene in motion whenever its files change. Ctrl-C ends it.

    The page has the truth and three engines, or those of --engine, and loads itself again. A file that makes no sense
    is one line here, and the page stays.
    """
    options.begin_workers(judges=False)
    from proofroll.core.time_grid import time_grid
    from proofroll.running.idle_workers import Workers

    options.require_writable(out)
    options.require_pages()
    if out.suffix.lower() != ".html":
        raise InputError("--out", out, "what is watched is a page: end the name of the file in .html")
    time_grid(0.0 if until is None else until, _UNIT)
    named, seen, workers = options.controlled(scene, control), None, Workers(patience=_LIMIT)
    while True:
        if (now := _written(scene, control)) != seen:
            seen = now
            try:
                _show(named, engine or _ENGINES, options.assignments(settings), until, out, workers)
            except ProofrollError as problem:
                if once:
                    raise
                options.complain(str(problem))
            if once:
                return
        time.sleep(_LOOK)


def _written(scene: str, control: Path | None) -> dict[Path, tuple[int, int]]:
    """Times [ns] and sizes of the files beside those of a scene but pages and hidden ones, which are not its own."""
    from proofroll.files.scene_sources import resolved

    places = [Path(resolved(scene)), *([control.resolve()] if control else [])]
    written = {}
    for file in (file for place in places for file in (place if place.is_dir() else place.parent).glob("[!.]*")):
        with suppress(OSError):  # it may vanish meanwhile
            if file.is_file() and file.suffix.lower() not in (".html", ".js"):
                written[file] = (file.stat().st_mtime_ns, file.stat().st_size)
    return written


def _write(out: Path, scene: str, runs: Sequence[xr.Dataset], begun: float, **others: Any) -> None:
    """Writes the page of runs, and the script that tells it that it is a new one; ``others``: of the replay page."""
    from proofroll.report.run.replay import replay_page
    from proofroll.running.store import write_text

    version = str(time.time_ns())
    write_text(out, replay_page(out, runs[0], scene, runs[1:], script=f"{out.stem}.js", version=version, **others))
    write_text(out.with_suffix(".js"), f"window.proofrollVersion = {version!r};\n")
    shown = ", ".join([*(str(run.attrs["engine"]) for run in runs), *(["truth"] if "true" in others else [])])
    options.complain(f"{out}: {shown}, {time.monotonic() - begun:.1f} s")


def _show(
    scene: str, engines: Sequence[str], settings: dict[str, str], until: float | None, out: Path, workers: Workers
) -> None:
    """Runs a scene in engines one after another, and writes the page after each.

    Engines start, one after another, beside the imports and the first page.

    Raises:
        ProofrollError: the scene makes no sense, or no engine runs it.
    """
    import tempfile
    from concurrent.futures import ThreadPoolExecutor
    from functools import partial

    from proofroll.running.engine_questions import prepare

    page = partial(_write, out, scene, begun=time.monotonic())
    runs: list[xr.Dataset] = []
    truths: list[xr.Dataset] = []
    reason, count = "its truth is still being computed", 0
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(1) as pool:
        starts = {engines[0]: pool.submit(prepare, engines[0], workers)}
        from proofroll.core.pace import PACE
        from proofroll.core.truth import truth
        from proofroll.files.trajectory_file import STORED, import_xarray, read
        from proofroll.report.page import html  # noqa: F401 -- imported while the engine starts
        from proofroll.running.runner import run_one
        from proofroll.studies.cases import length_of, scene_of_run, single_case

        import_xarray()
        loaded, length = scene_of_run(scene, settings), length_of(scene, until)
        starts |= {name: pool.submit(prepare, name, workers) for name in engines if name not in starts}
        every = max(_UNIT, round(length / _INTERVALS / _UNIT) * _UNIT)
        for name in engines:
            starts[name].result()
            target = Path(folder) / f"{len(runs)}{STORED}"
            try:
                case = single_case(scene, settings, name, until=length, every=every, time_limit=_LIMIT, workers=workers)
                result = run_one(case, target, workers)
            except ProofrollError as problem:
                options.complain(f"{name}: {problem}")
                continue
            if result.trajectory is None:
                options.complain(f"{name} {result.status}: {result.message}")
                continue
            runs.append(read(target).load())
            if not count:
                page(runs, untold=reason)
            longest = max((run["time"].to_numpy() for run in runs), key=len)
            if count < len(longest):
                count = len(longest)
                try:
                    with PACE.limited(_LIMIT):
                        truths = [truth(loaded.fully_asked, longest)]
                except ProofrollError as problem:
                    reason = str(problem)
            page(runs, true=truths[-1]) if truths else page(runs, untold=reason)
    if not runs:
        raise ProofrollError(f"{scene}: no engine runs it; proofroll engines tells what is installed")
