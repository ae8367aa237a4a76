"""Options, exit codes, progress and output that all commands share."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from proofroll.core.errors import InputError, Missing, ProofrollError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from proofroll.running.cluster import Cluster
    from proofroll.running.idle_workers import Workers
    from proofroll.running.runner import Runner

_SAID_EVERY = 10.0  # interval between lines of progress if no bar can be shown [s]
OK, CONTRADICTED, USAGE, ENGINE, INTERRUPTED = 0, 1, 2, 3, 130


def scenes_like(incomplete: str) -> list[str]:
    """Names of scenes with this beginning, for completion in a shell."""
    from proofroll.files.scene_file import scene_names

    return [name for name in scene_names() if name.startswith(incomplete)]


def own_first(named: Any) -> Any:
    """Names as given; in place of one of a shipped scene the path of a folder here that is called so, with a line.

    It is the callback of arguments; who calls functions of proofroll reads the shipped scene by its name.

    Args:
        named: a name, several, or None.
    """
    if isinstance(named, list):
        return [own_first(name) for name in named]
    if not named or Path(named).name != named or not (Path(named) / "scene.toml").is_file():
        return named
    from proofroll.files.data_folders import data_folder

    shipped = data_folder("models") / named
    if not shipped.is_dir() or shipped.samefile(named):
        return named
    complain(f"{named} is read from the folder ./{named} here; proofroll has a scene of that name, too")
    return f"./{named}"


def compared_like(incomplete: str) -> list[str]:
    """Names of comparisons and scenes with this beginning, for completion in a shell."""
    from proofroll.files.comparison_file import comparison_names, further_comparison_names

    named = {*comparison_names(), *further_comparison_names(), *scenes_like(incomplete)}
    return sorted(name for name in named if name.startswith(incomplete))


def engines_like(incomplete: str) -> list[str]:
    """Names of engines with this beginning, for completion in a shell."""
    from proofroll.core.plugins import engine_names

    return [name for name in engine_names() if name.startswith(incomplete)]


def runs_like(incomplete: str) -> list[str]:
    """Names of engines, and ``truth``, with this beginning, for completion in a shell."""
    return [*(["truth"] if "truth".startswith(incomplete) else []), *engines_like(incomplete)]


Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output, nothing else.")]
Out = Annotated[Path, typer.Option("--out", help="Folder for results; stored results are reused.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Run every case again, whatever is stored.")]
Comment = Annotated[Path | None, typer.Option("--comment", help="Write the changes to this file in Markdown.")]
Jobs = Annotated[int | None, typer.Option("--jobs", min=1, help="Workers at once; by default one per core.")]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", help="Run the cases on a Dask cluster: tcp://…, or local:4 for 4 workers here."),
]
Engines = Annotated[
    list[str] | None,
    typer.Option("--engine", help="Restrict to an engine; may be repeated.", autocompletion=engines_like),
]
SceneName = Annotated[
    str,
    typer.Argument(
        help="A scene: its name, a folder with a scene.toml, or a robot file.",
        autocompletion=scenes_like,
        callback=own_first,
    ),
]
Budget = Annotated[
    float | None,
    typer.Option(
        "--budget", min=1, help="Processor-seconds for a scene or robot file, compilation included; by default 60."
    ),
]
Until = Annotated[
    float | None,
    typer.Option("--until", help="Last time [s]; by default 2, or the scene's duration where that is shorter."),
]
Tolerances = Annotated[
    list[str] | None,
    typer.Option("--tolerance", help="1e-4 of the path (default), '0.1 %' of it, '1 mm', or QUANTITY='1 mm'; repeat."),
]
Control = Annotated[
    Path | None,
    typer.Option("--control", help="TOML file of the controller of a robot file: gains, targets or policy, start."),
]
Ground = Annotated[
    Literal["file", "plane", "none"] | None,
    typer.Option(
        "--ground",
        help="With --control: the robot stands on the floor of its file, on a plane z = 0, or is in the air; "
        "by default as the controller's [ground] says.",
    ),
]
Set = Annotated[
    list[str] | None, typer.Option("--set", help="parameter=value, in SI units or as '30 deg', '2 mm'; repeat.")
]


def _read_below(context: typer.Context, root: Path | None) -> Path | None:
    """Sets the folder of robot files while a command runs, for this process and its workers, if one is given."""
    if root is None:
        return None
    if not root.is_dir():
        raise InputError("--root", root, "there is no such folder")
    from proofroll.files.scene_sources import ROOT

    os.environ[ROOT] = str(root.resolve())
    context.call_on_close(lambda: os.environ.pop(ROOT))
    return root


Root = Annotated[
    Path | None,
    typer.Option(
        "--root", help="Folder of what a robot file includes and its meshes; by default its own.", callback=_read_below
    ),
]


def controlled(scene: str, control: Path | None) -> str:
    """Name of a scene under the controller of ``--control``; without the option the name of the scene."""
    if control is None:
        return scene
    from proofroll.files.scene_sources import with_control

    return with_control(scene, control)


def with_ground(settings: list[str] | None, control: Path | None, ground: str | None) -> list[str] | None:
    """Assignments of ``--set`` with that of ``--ground``. Raises InputError without a controller."""
    if ground is None:
        return settings
    if control is None:
        raise InputError("--ground", ground, "a robot stands under a controller; give that with --control, too")
    return [*(settings or ()), f"ground={('none', 'file', 'plane').index(ground)}"]


def doubt_numbers(scene: str, settings: list[str] | None) -> None:
    """Prints on standard error which numbers of a robot's controller are probably in another unit."""
    from proofroll.core.element_abilities import DoubtsNumbers
    from proofroll.studies.cases import scene_of_run

    for element in scene_of_run(scene, assignments(settings), ()).elements:
        for line in element.implausible if isinstance(element, DoubtsNumbers) else ():
            complain(f"warning: {line}")


def begin_workers(*, judges: bool = True) -> None:
    """Imports what most workers need but engines, and forks them from here on, see :func:`.forked.begin_template`.

    ``judges``: True if this process judges runs, which needs more.
    """
    from proofroll.core.entry_points import announced
    from proofroll.running.forked import begin_template

    kinds = [point.module for point in announced("proofroll.elements") if point.module.startswith("proofroll.")]
    modules = "proofroll.core.first_steps", "proofroll.running.recording", "proofroll.running.worker"
    begin_template(*modules, *kinds, "scipy.optimize" if judges else "scipy.spatial.transform")


def new_runner(
    out: Path, fresh: bool, jobs: int | None, scheduler: str | None = None, workers: Workers | None = None
) -> Runner:
    """Runner in worker processes, on this machine or on a cluster, that keeps results under ``out``."""
    from proofroll.files.trajectory_file import import_xarray
    from proofroll.running.runner import Runner
    from proofroll.running.store import Store

    if scheduler is None:  # without dask, which a cluster may need
        import_xarray()
    store = Store(out / "cases")  # raises for a folder that cannot be written, before a cluster is started
    return Runner(store, jobs=jobs, fresh=fresh, cluster=new_cluster(scheduler), workers=workers)


def new_cluster(scheduler: str | None) -> Cluster | None:
    """Cluster of ``--scheduler``, or None if the option is not given."""
    if scheduler is None:
        return None
    from proofroll.running.cluster import connected

    return connected(scheduler)


@contextmanager
def progress_bar(what: str, total: int | None = None) -> Iterator[Callable[..., None]]:
    """Context manager with a progress bar on standard error.

    It yields a function to be called with a description and, if not 1, a count, and a total that has changed. If
    standard error is no terminal, or nothing may move there, it prints a line every few seconds instead.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, Task, TextColumn, TimeElapsedColumn
    from rich.text import Text

    class Described(TextColumn):
        def render(self, task: Task) -> Text:
            return super().render(task).append(_waited_for())

    columns = (Described("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    console, moves = _standard_error()
    with Progress(*columns, console=console, transient=True, disable=not moves) as progress:
        task = progress.add_task(what, total=total)

        def line() -> str:
            now = progress.tasks[0]
            amount = "" if now.total is None and not now.completed else f": {now.completed:g}"
            return f"{now.description}{amount}{'' if now.total is None else f' of {now.total:g}'}"

        with nullcontext() if moves else _now_and_then(line):
            yield lambda description, count=1, total=None: progress.update(
                task, advance=count, description=description, total=total
            )


@contextmanager
def growing(lines: Callable[[], Sequence[RenderableType]], last: Callable[[], str], *, shown: bool) -> Iterator[bool]:
    """Context manager with growing lines on a terminal, which it removes at the end; yields True if it shows them.

    If standard error is no terminal, or nothing may move there, it prints the line of progress every few seconds.

    Args:
        lines: gives the lines so far; the last ones that fit the screen are shown.
        last: gives the line below them, of progress, without the time that has passed.
        shown: False to show nothing on a terminal.
    """
    from rich.console import Group
    from rich.live import Live
    from rich.text import Text

    console, moves = _standard_error()
    if not (shown and moves):
        with nullcontext() if moves else _now_and_then(last):
            yield False
        return
    start = time.monotonic()

    def visible() -> Group:
        text = f"  {last()}{_waited_for()}, {time.monotonic() - start:.0f} s"
        line = Text(text, overflow="ellipsis", no_wrap=True)
        return Group(*lines()[-max(1, console.height - 2) :], line)

    with Live(get_renderable=visible, console=console, transient=True):
        yield True


@contextmanager
def _now_and_then(line: Callable[[], str]) -> Iterator[None]:
    """Context manager that prints a line on standard error every few seconds, with the time that has passed."""
    start, ended = time.monotonic(), threading.Event()

    def say() -> None:
        while not ended.wait(_SAID_EVERY):
            complain(f"{line()}{_waited_for()}, {time.monotonic() - start:.0f} s")

    speaker = threading.Thread(target=say, daemon=True)
    speaker.start()
    try:
        yield
    finally:
        ended.set()
        speaker.join()


def _waited_for() -> str:
    """End of a line of progress: the engines that have not answered yet, or how far truths have come."""
    asking = sys.modules.get("proofroll.running.engine_questions")  # not imported: no engine was asked
    names = dict.fromkeys(asking.waited_for) if asking else ()
    if names:
        return f": waiting for {', '.join(names)} to start"
    running = sys.modules.get("proofroll.running.process")
    return "".join(f": {text}" for text in running.truths_at()) if running else ""


def _standard_error() -> tuple[Console, bool]:
    """Console on standard error, and True if a bar may move on it: not in a pipe, nor under NO_COLOR."""
    from proofroll.report.terminal.screen import Screen

    console = Screen(stderr=True)
    return console, console.is_terminal and not console.is_dumb_terminal and not os.environ.get("NO_COLOR")


def assignments(texts: list[str] | None, option: str = "--set") -> dict[str, str]:
    """Reads ``name=value`` texts of an option. Raises InputError for another form or a repeated name."""
    values: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise InputError(option, text, "write parameter=value")
        if name in values:
            raise InputError(option, text, f"{name} is given twice; give it once")
        values[name] = value
    return values


def require_only(
    context: typer.Context, allowed: Container[str], advice: str, further: Mapping[str, str] | None = None
) -> None:
    """Raises InputError for the first given option or argument that is not allowed: it would be ignored.

    Args:
        context: of the command.
        allowed: names of its parameters.
        advice: end of the message.
        further: name of a parameter -> more advice about it.
    """
    for parameter in context.command.params:
        name = str(parameter.name)
        source = context.get_parameter_source(name)
        if source is None or source.name != "COMMANDLINE" or name in allowed:
            continue
        value = context.params[name]
        shown = ", ".join(value) if isinstance(value, list) else value
        raise InputError(parameter.opts[0], shown, advice + (further or {}).get(name, ""))


def require_writable(path: Path, option: str = "--out") -> None:
    """Raises InputError before the run if a file cannot be written."""
    from proofroll.running.store import Store

    if path.is_dir():
        raise InputError(option, path, "this is a folder; name a file in it")
    try:
        Store(path.parent)
    except ProofrollError as error:
        raise InputError(option, path, str(error).removesuffix(" with --out")) from None


@contextmanager
def spinner(text: str) -> Iterator[Callable[[str], None]]:
    """Context manager with a sign of activity on standard error; it yields a function that changes its text."""
    from rich.text import Text

    class Present:
        def __rich__(self) -> Text:
            return Text(f"{texts[-1]}{_waited_for()}")

    console, moves = _standard_error()
    texts = [text]
    with console.status(Present()) if moves else _now_and_then(lambda: texts[-1]):
        yield texts.append


@contextmanager
def wall_limit(seconds: float, what: str) -> Iterator[None]:
    """Context manager whose body is ended after ``seconds`` of wall time; without effect where there are no alarms.

    Raises:
        InputError: the limit is not positive, or the body took longer.
    """
    if not 0 < seconds < math.inf:
        raise InputError("--time-limit", seconds, "give a positive, finite number of seconds")

    def ended(*_: object) -> None:
        advice = f"{what} took longer; end the trajectory sooner, or allow more"
        raise InputError("--time-limit", f"{seconds:g} s", advice)

    if not hasattr(signal, "setitimer"):
        yield
        return
    previous = signal.signal(signal.SIGALRM, ended)
    signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)  # once more each second: a library may drop an exception
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)


def json_text(content: object) -> str:
    """Text of a JSON document."""
    from proofroll.files.json_data import plain
    from proofroll.report.terminal.printable import escaped

    return escaped(json.dumps(plain(content), indent=1, ensure_ascii=False)) + "\n"


def write_json(content: object) -> None:
    """Writes one JSON document to standard output."""
    sys.stdout.write(json_text(content))


def show(
    content: object, as_json: bool, parts: Callable[[], Iterable[RenderableType]], *, widest: int | None = None
) -> None:
    """Prints the content of a command: one JSON document, or tables and lines.

    Args:
        content: records, or plain data.
        as_json: True for JSON.
        parts: makes the tables and lines.
        widest: columns; None: as many as :func:`proofroll.report.terminal.screen.console` has.
    """
    if as_json:
        write_json(content)
        return
    from proofroll.report.terminal.screen import console

    out = console()
    out.width = min(out.width, widest or out.width)
    for part in parts():
        out.print(part)


def show_lines(lines: Iterable[str], *, widest: int | None = None) -> None:
    """Prints lines within the width of the terminal; the continuation of a longer line is indented by two more.

    ``widest``: as of :func:`show`.
    """
    from proofroll.report.terminal.screen import console

    out = console()
    out.width = min(out.width, widest or out.width)
    for line in lines:
        indent = " " * (len(line) - len(line.lstrip()) + 2)
        parts = textwrap.wrap(line, out.width, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False)
        out.print("\n".join(parts))


def require_pages() -> None:
    """Checks before any work that the libraries for pages and pictures are installed.

    Raises:
        Missing: one is not.
    """
    from importlib.util import find_spec

    lacking = [name for name in ("itables", "jinja2", "matplotlib", "tsdownsample") if find_spec(name) is None]
    if lacking:
        raise Missing(f"pages need {', '.join(lacking)}, not installed here: pip install 'proofroll[report]'")


def complain(text: str) -> None:
    """Prints one line on standard error."""
    from proofroll.report.terminal.printable import printable

    sys.stderr.write(f"proofroll: {printable(' '.join(text.split()))}\n")
