"""The command line. Data goes to standard output, progress and problems to standard error."""

import io
import os
import re
import signal
import sys
import warnings
from functools import cache
from importlib.metadata import EntryPoint
from typing import Annotated, Any

import typer

import proofroll
from proofroll.cli.cite import cite
from proofroll.cli.comparing import compare
from proofroll.cli.engines import engines
from proofroll.cli.export import export
from proofroll.cli.findings import findings
from proofroll.cli.judge import judge
from proofroll.cli.ladder import ladder
from proofroll.cli.lists import scenes
from proofroll.cli.new import new
from proofroll.cli.options import ENGINE, INTERRUPTED, OK, USAGE, complain
from proofroll.cli.plot import plot, replay
from proofroll.cli.recommend import recommend
from proofroll.cli.report import report
from proofroll.cli.run import run
from proofroll.cli.stability import stability
from proofroll.cli.tradeoff import tradeoff
from proofroll.cli.versions import versions
from proofroll.core.announced import broken, leave_out, loaded
from proofroll.core.errors import InputError, Missing, ProofrollError, choices
from proofroll.running.ending import INTERRUPTS, end_at_once

app = typer.Typer(
    help="Which multibody engine, formulation and time step can you trust for a scene?",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
_STUDIES = (compare, report, tradeoff, recommend, ladder, stability, versions)
for _command in (scenes, run, judge, plot, replay, export, findings, cite, *_STUDIES):
    app.command()(_command)
app.add_typer(new, name="new")
app.add_typer(engines, name="engines")


def _add_announced() -> None:
    """Adds the commands of other packages, and of parts of this one; what is none is left out."""
    with warnings.catch_warnings(action="ignore"):  # they are told at the end, a line each
        for point, added in loaded("proofroll.commands", object):
            if isinstance(added, typer.Typer):
                app.add_typer(added, name=point.name)
            else:
                _add_command(point, added)


def _add_command(point: EntryPoint, added: Any) -> None:
    if not callable(added):
        leave_out(point, "is no command: neither a function nor a typer.Typer")
        return
    alone = typer.Typer()
    alone.command()(added)
    try:  # or a parameter of which no option can be made would end all commands
        typer.main.get_command(alone)
    except Exception as error:
        leave_out(point, f"is no command ({type(error).__name__}: {error})")
        return
    app.command(point.name)(added)


_add_announced()


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    """Cross-validate multibody engines: which engine, formulation and time step can you trust for a scene?"""
    if version:
        sys.stdout.write(f"proofroll {proofroll.__version__}\n")
        raise typer.Exit(OK)
    if context.invoked_subcommand is None:
        sys.stdout.write(context.get_help() + "\n")
        raise typer.Exit(USAGE)


def _told(error: typer.TyperException) -> str:
    """Message of a usage error, with what typer leaves out: the wrong value, or the names to choose from."""
    said = str(error.format_message())
    lacking: Any = error  # typer tells no type of one that names its parameter
    if said.startswith("Missing ") and getattr(error, "param", None) is not None:
        names = [item.value for item in lacking.param.shell_complete(lacking.ctx, "")]
        return f"{said} Choose one of {choices(names)}." if names else said
    problems: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()
    option = re.search(r"'([^']+)'", said)
    if not problems or option is None:
        return said
    from proofroll.core.validation import advice

    return f"{option[1]} = {problems[0]['input']!r}: {advice(problems[0]['type'], problems[0]['msg'])}"


def _interrupt(*_: object) -> None:
    """Ends all workers, so that whatever waits for one goes on, and then this process; at once when asked again."""
    if "proofroll.running.process" in sys.modules:
        from proofroll.running.process import end_all

        end_all()
    for each in INTERRUPTS:
        if callable(signal.getsignal(each)):
            signal.signal(each, end_at_once)
    raise KeyboardInterrupt


def _prepare_output() -> None:
    """Standard output is there where a shell closed it (``>&-``), and one without our signs shows ? for them."""
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 -- open to the end
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")


# A call of ``app`` makes all of them again, which takes longer than many a command.
@cache
def _commands() -> Any:
    made: Any = typer.main.get_command(app)
    groups = [made]
    for group in groups:  # which grows
        for command in group.commands.values():
            command.short_help = (command.help or "").partition("\n\n")[0]  # else it is cut
            groups += [command] if hasattr(command, "commands") else []
    return made


def main() -> None:
    """Entry point: every problem is one line on standard error and an exit code."""
    _prepare_output()
    signal.signal(signal.SIGTERM, _interrupt)  # a time limit from outside also ends the workers
    if signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:  # so does the end of the terminal, but for nohup
        signal.signal(signal.SIGHUP, _interrupt)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as a shell may have told us
        signal.signal(signal.SIGINT, _interrupt)
    warnings.simplefilter("ignore", RuntimeWarning)  # of numbers that overflow: what comes of them is told
    try:
        if not all(map(str.strip, sys.argv[1:])):
            raise InputError("argument", "", "this is empty; give a value, or leave the option out")
        code = _commands()(standalone_mode=False)
        sys.stdout.flush()  # a full disk shows here, or nowhere
    except typer.TyperException as error:
        if error.format_message().startswith("Usage:"):  # a group of commands without one
            sys.stdout.write(f"{error.format_message()}\n")
        else:
            complain(_told(error))
        code = USAGE
    except InputError as error:
        complain(str(error))
        code = USAGE
    except ProofrollError as error:
        from proofroll.core.errors import Refused
        from proofroll.running.process import WorkerDied

        complain(str(error))
        code = ENGINE if isinstance(error, (Missing, WorkerDied, Refused)) else USAGE
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except (OSError, SystemExit) as error:
        code = _unwritten(error)
    for said in broken.values():
        complain(said)
    if code == INTERRUPTED:
        complain("interrupted; cases that were finished and stored will be reused")
    sys.exit(code or OK)


def _unwritten(error: OSError | SystemExit) -> Any:
    """Exit code if output cannot be written; a pipe that its reader closed is no error."""
    if isinstance(error, SystemExit):
        if not isinstance(error.__context__, BrokenPipeError):
            return error.code  # of a command
        error = error.__context__  # typer tells that as a failure
    # what is left in the buffers would be tried again at the end
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    if isinstance(error, BrokenPipeError):
        return OK
    place = f"{error.filename} cannot be used" if error.filename else "the output cannot be written"
    complain(f"{place} ({error.strerror or error})")
    return USAGE
