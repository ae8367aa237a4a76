"""What every command needs: options, exit codes, progress and the ways to print."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from proofroll.core.errors import InputError

if TYPE_CHECKING:
    from proofroll.running.runner import Runner

OK, CONTRADICTED, USAGE, ENGINE, INTERRUPTED = 0, 1, 2, 3, 130

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output, nothing else.")]
Out = Annotated[Path, typer.Option("--out", help="Folder for results; what is there is reused.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Run every case again, whatever is stored.")]
Jobs = Annotated[int | None, typer.Option("--jobs", min=1, help="Workers at once; by default one per core.")]
Engines = Annotated[list[str] | None, typer.Option("--engine", help="Restrict to an engine; may be repeated.")]
SceneName = Annotated[str, typer.Argument(help="Name of a scene, or path of a folder with a scene.toml.")]
Set = Annotated[list[str] | None, typer.Option("--set", help="parameter=value in SI units; repeat.")]


def new_runner(out: Path, fresh: bool, jobs: int | None) -> Runner:
    """Runs cases in worker processes and keeps their results under ``out``."""
    from proofroll.running.runner import Runner
    from proofroll.running.store import Store

    return Runner(Store(out / "cases"), jobs=jobs, fresh=fresh)


@contextmanager
def progress_bar(what: str, total: int | None = None) -> Iterator[Callable[..., None]]:
    """A progress bar on standard error; call what it gives with a description and, if not 1, a count."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from proofroll.report.screen import Screen

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    console = Screen(stderr=True)  # where it is no terminal, a bar would leave empty lines before an error
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(what, total=total)
        yield lambda description, count=1: progress.update(task, advance=count, description=description)


def assignments(texts: list[str], option: str = "--set") -> dict[str, str]:
    """Reads ``name=value``, as given to an option."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise InputError(option, text, "write parameter=value")
        if name in found:
            raise InputError(option, text, f"{name} is given twice; give it once")
        found[name] = value
    return found


def require_writable(path: Path) -> None:
    """Fails before the run rather than after it."""
    from proofroll.running.store import Store

    if path.is_dir():
        raise InputError("--out", str(path), "this is a folder; name a file")
    Store(path.parent)


def spinner(text: str) -> Any:
    """A sign on standard error that something is under way."""
    from proofroll.report.screen import Screen

    return Screen(stderr=True).status(text)


def write_json(content: object) -> None:
    """One JSON document on standard output."""
    from proofroll.files.json_data import plain
    from proofroll.report.screen import escaped

    sys.stdout.write(escaped(json.dumps(plain(content), indent=1, ensure_ascii=False)) + "\n")


def complain(text: str) -> None:
    """One line on standard error."""
    from proofroll.report.screen import printable

    sys.stderr.write(f"proofroll: {printable(' '.join(text.split()))}\n")
