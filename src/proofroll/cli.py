"""The command line. Data goes to standard output, progress and problems to standard error."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import proofroll
from proofroll.errors import InputError, Missing, ProofrollError

if TYPE_CHECKING:
    from proofroll.runner import Runner
    from proofroll.studies.compare import Outcome

app = typer.Typer(
    help="Which multibody engine, formulation and time step can you trust for a scene?",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

OK, CONTRADICTED, USAGE, ENGINE, INTERRUPTED = 0, 1, 2, 3, 130

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output, nothing else.")]
Out = Annotated[Path, typer.Option("--out", help="Folder for results; what is there is reused.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Run every case again, whatever is stored.")]
Jobs = Annotated[int | None, typer.Option("--jobs", min=1, help="Workers at once; by default one per core.")]
Engines = Annotated[list[str] | None, typer.Option("--engine", help="Restrict to an engine; may be repeated.")]


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    """Which multibody engine, formulation and time step can you trust for a scene?"""
    if version:
        sys.stdout.write(f"proofroll {proofroll.__version__}\n")
        raise typer.Exit(OK)
    if context.invoked_subcommand is None:
        sys.stdout.write(context.get_help() + "\n")
        raise typer.Exit(USAGE)


@app.command()
def scenes(as_json: Json = False) -> None:
    """List the scenes and the parameters that can be set."""
    from proofroll.scene_file import read_scene_file, scene_names

    files = {name: read_scene_file(name) for name in scene_names()}
    if as_json:
        import dataclasses

        _print_json(
            [
                {
                    "name": name,
                    "title": file.title,
                    "source": file.source,
                    "parameters": {key: dataclasses.asdict(item) for key, item in file.parameters.items()},
                }
                for name, file in files.items()
            ]
        )
        return
    from rich.table import Table

    from proofroll.report.terminal import console

    out = console()
    for name, file in files.items():
        table = Table(title=f"{name}: {file.title}", title_justify="left", box=None, pad_edge=False)
        for column in ("parameter", "symbol", "default", "unit", "meaning"):
            table.add_column(column)
        for key, item in file.parameters.items():
            value = item.value if isinstance(item.value, str) else f"{item.value:g}"
            table.add_row(key, item.symbol, value, item.unit, item.meaning)
        out.print(table)
        out.print()


@app.command()
def engines(as_json: Json = False) -> None:
    """List the engines: what is installed, what each provides, and why one is missing."""
    from concurrent.futures import ThreadPoolExecutor

    from proofroll.registry import engine_names

    with ThreadPoolExecutor() as pool:
        found = list(pool.map(_described, engine_names()))
    if as_json:
        _print_json(found)
        return
    from rich.table import Table

    from proofroll.report.terminal import console

    table = Table(box=None, pad_edge=False)
    for column in ("engine", "version", "formulations (settings)", "provides"):
        table.add_column(column)
    for item in found:
        if item["status"] != "installed":
            table.add_row(item["name"], item["status"], item["message"], "")
            continue
        formulations = "\n".join(f"{name} ({', '.join(presets)})" for name, presets in item["presets"].items())
        table.add_row(item["name"], item["version"], formulations, "\n".join(item["provides"]))
    console().print(table)


def _described(name: str) -> dict[str, Any]:
    from proofroll.runner import describe

    try:
        return {"status": "installed", **describe(name)}
    except Missing as error:
        return {"name": name, "status": "missing", "message": str(error)}
    except ProofrollError as error:
        return {"name": name, "status": "broken", "message": str(error)}


@app.command()
def run(
    scene: Annotated[str, typer.Argument(help="Name of a scene, or path of a folder with a scene.toml.")],
    engine: Annotated[str, typer.Option(help="truth, or name[key=value,…], e.g. mujoco[formulation=chart,dt=1e-4].")],
    settings: Annotated[list[str] | None, typer.Option("--set", help="parameter=value in SI units; repeat.")] = None,
    until: Annotated[float, typer.Option(help="Last time [s].")] = 2.0,
    every: Annotated[float, typer.Option(help="Interval between samples [s].")] = 0.01,
    out: Annotated[Path | None, typer.Option(help="Write the trajectory to this netCDF file.")] = None,
    time_limit: Annotated[float, typer.Option(help="Wall seconds after which the run is ended.")] = 600.0,
    as_json: Json = False,
) -> None:
    """Run one scene in one engine."""
    import tempfile

    from proofroll.recording import time_grid
    from proofroll.report.run import run_content, run_lines
    from proofroll.runner import run_one
    from proofroll.studies.single import single_case

    time_grid(until, every)
    if out is not None:
        _require_writable(out)
    case = single_case(scene, _assignments(settings or []), engine, until=until, every=every, time_limit=time_limit)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "run.nc"
        with _spinner(f"{scene} in {case.engine.name}"):
            result = run_one(case, target)
        content = run_content(case, result, target)
        if out is not None and result.trajectory is not None:
            from proofroll.store import move

            move(target, out)
    if as_json:
        _print_json(content)
    else:
        from proofroll.report.terminal import console

        for line in run_lines(content):
            console().print(line)
    if content["status"] != "done":
        _complain(f"{content['engine']} {content['status']}: {content['message']}")
        raise typer.Exit(ENGINE)


@app.command()
def compare(
    comparison: Annotated[str, typer.Argument(help="A comparison file, e.g. comparisons/paper.toml, or its name.")],
    engine: Engines = None,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Hold the engines of a comparison file against the truth; exit 1 if a verdict contradicts the file."""
    from proofroll.comparison_file import load_comparison
    from proofroll.report.content import outcome_content

    loaded = load_comparison(comparison)
    outcomes = _outcomes([loaded], engine or [], _runner(out, fresh, jobs))
    content = outcome_content(outcomes[0])
    if as_json:
        _print_json(content)
    else:
        _print_outcome(content)
    raise typer.Exit(_exit_code(outcomes))


@app.command()
def report(
    studies: Annotated[list[str] | None, typer.Argument(help="Comparison files or names; all by default.")] = None,
    engine: Engines = None,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Run the comparisons and write report.html and report.json."""
    from proofroll.comparison_file import comparison_names, load_comparison
    from proofroll.report.html import write_report

    loaded = [load_comparison(name) for name in studies or comparison_names()]
    runner = _runner(out, fresh, jobs)
    outcomes = _outcomes(loaded, engine or [], runner)
    command = "proofroll report " + " ".join(studies or [])
    maps = [_regime_maps(item, jobs) if item.regimes else [] for item in loaded]
    content = write_report(outcomes, runner.store, out, command.strip(), maps)
    if as_json:
        _print_json(content)
    else:
        for item in content["comparisons"]:
            _print_outcome(item)
        from proofroll.report.terminal import console

        console().print(f"The report is in {out / 'report.html'}; the same content in {out / 'report.json'}.")
    raise typer.Exit(_exit_code(outcomes))


@app.command()
def onset(
    scene: Annotated[str, typer.Argument(help="Name of a scene, or path of a folder with a scene.toml.")],
    settings: Annotated[list[str] | None, typer.Option("--set", help="parameter=value in SI units; repeat.")] = None,
    engine: Annotated[list[str] | None, typer.Option(help="Engine with settings; repeat. All that can slip.")] = None,
    until: Annotated[float, typer.Option(help="How long to look for a slip [s].")] = 4.0,
    uncertainty: Annotated[float, typer.Option(help="Relative uncertainty of friction and resistance.")] = 1e-3,
    out: Out = Path("out"),
    fresh: Fresh = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Say when the ball first slips, in every engine, and how well that is posed."""
    from proofroll.recording import time_grid
    from proofroll.studies.onset import onset_study, summary

    time_grid(until, 0.01)
    with _progress("runs") as advance:
        study = onset_study(
            scene,
            dict(_assignments(settings or [])),
            _runner(out, fresh, jobs),
            engines=engine or (),
            until=until,
            uncertainty=uncertainty,
            progress=lambda case, _: advance(case.engine.name),
        )
    content = study.content()
    if as_json:
        _print_json(content)
    else:
        from proofroll.report.terminal import console, onset_table

        console().print(summary(content), markup=False)
        console().print(onset_table(content))
    verdicts = {item["verdict"] for item in content["engines"]}
    # A refusal is an answer where nobody asked for that engine in particular.
    if "failed" in verdicts or (engine and "refused" in verdicts):
        raise typer.Exit(ENGINE)
    raise typer.Exit(CONTRADICTED if "disagree" in verdicts else OK)


@app.command()
def regimes(
    study: Annotated[str, typer.Argument(help="A comparison file with a [regimes] table, or its name.")] = "stick_slip",
    out: Out = Path("out"),
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Draw the map over speed and friction: never slips, slips and recovers, falls."""
    from proofroll.comparison_file import load_comparison
    from proofroll.report.regime_map import draw, regime_content
    from proofroll.store import Store, write_text

    loaded = load_comparison(study)
    Store(out)  # fails before the work rather than after it
    maps = _regime_maps(loaded, jobs)
    content = regime_content(maps)
    draw(maps, out / "regimes.svg")
    write_text(out / "regimes.json", json.dumps(content, indent=1))
    if as_json:
        _print_json(content)
        return
    from proofroll.report.terminal import console

    for item in content["maps"]:
        said = ", ".join(f"{count} {name}" for name, count in item["counts"].items())
        console().print(f"f = {item['rolling_resistance']:g} m, {item['runs']} runs of {item['until']:g} s: {said}.")
        if item["outside_boundaries"] is not None:
            console().print(f"  {item['outside_boundaries']} of them on the wrong side of the analytic boundaries.")
    console().print(f"The map is in {out / 'regimes.svg'}, its numbers in {out / 'regimes.json'}.")


def _runner(out: Path, fresh: bool, jobs: int | None) -> Runner:
    from proofroll.runner import Runner
    from proofroll.store import Store

    return Runner(Store(out / "cases"), jobs=jobs, fresh=fresh)


def _outcomes(comparisons: list[Any], engines: list[str], runner: Runner) -> list[Outcome]:
    """Runs all comparisons with one progress bar."""
    from proofroll.studies.compare import evaluate, plan

    plans = [plan(comparison, engines) for comparison in comparisons]
    cases = {case.key: case for item in plans for case in item.cases}
    with _progress("cases", total=len(cases)) as advance:
        results = runner.run(cases.values(), lambda case, _: advance(case.engine.name))
    return [evaluate(item, results, runner) for item in plans]


def _regime_maps(comparison: Any, jobs: int | None) -> list[Any]:
    """The comparison's regime maps, with a progress bar."""
    import os

    from proofroll.studies.regimes import regime_maps

    total = comparison.regimes.count if comparison.regimes else None
    with _progress("runs of the truth", total=total) as advance:
        return regime_maps(comparison, jobs or os.cpu_count() or 1, lambda count: advance("runs of the truth", count))


@contextmanager
def _progress(what: str, total: int | None = None) -> Iterator[Callable[..., None]]:
    """A progress bar on standard error; call what it gives with a description and, if not 1, a count."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    console = Console(stderr=True)  # where it is no terminal, a bar would leave empty lines before an error
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(what, total=total)
        yield lambda description, count=1: progress.update(task, advance=count, description=description)


def _exit_code(outcomes: list[Outcome]) -> int:
    if any(outcome.lost for outcome in outcomes):
        return ENGINE
    return CONTRADICTED if any(outcome.contradictions for outcome in outcomes) else OK


def _print_outcome(content: dict[str, Any]) -> None:
    from proofroll.report.terminal import closing_lines, console, verdict_table

    out = console()
    out.print(verdict_table(content))
    for line in closing_lines(content):
        out.print(line, markup=False)
    out.print()


def _assignments(texts: list[str]) -> dict[str, str]:
    """Reads ``name=value``."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise InputError("--set", text, "write parameter=value")
        if name in found:
            raise InputError("--set", text, f"{name} is given twice; give it once")
        found[name] = value
    return found


def _require_writable(path: Path) -> None:
    """Fails before the run rather than after it."""
    from proofroll.store import Store

    if path.is_dir():
        raise InputError("--out", str(path), "this is a folder; name a file")
    Store(path.parent)


def _spinner(text: str) -> Any:
    from rich.console import Console

    return Console(stderr=True).status(text)


def _print_json(content: object) -> None:
    from proofroll.report.content import plain

    sys.stdout.write(json.dumps(plain(content), indent=1, ensure_ascii=False) + "\n")


def _complain(text: str) -> None:
    sys.stderr.write(f"proofroll: {' '.join(text.split())}\n")


def _given(error: typer.TyperException) -> str:
    """The offending value, which typer's messages about numbers leave out."""
    problems: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()
    return f" (given: {problems[0]['input']!r})" if problems else ""


def main() -> None:
    """Entry point: every problem is one line on standard error and an exit code."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a time limit from outside also ends the workers
    try:
        code = app(standalone_mode=False)
    except typer.TyperException as error:
        _complain(f"{error.format_message()}{_given(error)}")
        code = USAGE
    except InputError as error:
        _complain(str(error))
        code = USAGE
    except ProofrollError as error:
        from proofroll.errors import Refused
        from proofroll.runner import WorkerDied

        _complain(str(error))
        code = ENGINE if isinstance(error, (Missing, WorkerDied, Refused)) else USAGE
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except BrokenPipeError:
        code = OK  # the reader of our output has seen enough
    if code == INTERRUPTED:
        _complain("interrupted; cases of a comparison that were finished are stored and will be reused")
    sys.exit(code or OK)


if __name__ == "__main__":
    main()
