"""Command line. Data goes to standard output, progress and problems to standard error."""

import codecs
import copy
import io
import os
import re
import signal
import sys
import warnings
from collections.abc import Sequence
from difflib import get_close_matches
from functools import cache
from importlib.metadata import EntryPoint
from typing import Annotated, Any

import typer

import proofroll
from proofroll.cli.command_groups import NOW, GroupedCommands
from proofroll.cli.comparing import compare
from proofroll.cli.diff import diff
from proofroll.cli.engines import engines
from proofroll.cli.judge import judge
from proofroll.cli.lists import cite, findings, scenes
from proofroll.cli.new import new
from proofroll.cli.options import ENGINE, INTERRUPTED, OK, USAGE, complain
from proofroll.cli.recommend import recommend
from proofroll.cli.report import report
from proofroll.cli.run import run
from proofroll.cli.studies import ladder, stability
from proofroll.cli.watch import watch
from proofroll.cli.written_files import export, replay
from proofroll.core.entry_points import broken, leave_out, loaded
from proofroll.core.errors import InputError, Missing, ProofrollError, choices
from proofroll.report.terminal.printable import spelled_out
from proofroll.running.process_end import INTERRUPTS, end_at_once

app = typer.Typer(
    cls=GroupedCommands,
    help="Which multibody engine, formulation and time step can you trust for a scene?",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
_ALIKE = 0.7  # least likeness, of 1, of an option that a wrong one may mean
_STUDIES = (compare, report, recommend, ladder, stability, diff)
for _command in (scenes, run, judge, replay, watch, export, findings, cite, *_STUDIES):
    app.command()(_command)
app.add_typer(new, name="new")
app.add_typer(engines, name="engines")


def _add_announced() -> None:
    """Adds the commands that other packages and parts of this one announce; invalid ones are left out."""
    with warnings.catch_warnings(action="ignore"):  # main prints them at the end, a line each
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
    try:  # a parameter that typer cannot turn into an option would otherwise break all commands
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


def _usage_message(error: typer.TyperException) -> str:
    """Message of a usage error, completed by the wrong value or the names to choose from, which typer leaves out."""
    message = str(error.format_message())
    lacking: Any = error  # typer has no public type for errors with a parameter
    if message.startswith("Missing ") and getattr(error, "param", None) is not None:
        names = [item.value for item in lacking.param.shell_complete(lacking.ctx, "")]
        return f"{message} Choose one of {choices(names)}." if names else message
    if unknown := re.match(r"No such command '([^']+)'", message):
        return f"{unknown[1]} is now {NOW[unknown[1]]}" if unknown[1] in NOW else message
    context = getattr(error, "ctx", None)
    options_here = [name for item in (context.command.params if context else ()) for name in item.opts]
    if unknown := re.match(r"No such option: --([\w-]+)", message):
        return _unknown_option(unknown[1], options_here)
    problems: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()
    option = re.search(r"'([^']+)'", message)
    if not problems or option is None:
        return message
    from proofroll.core.validation import advice

    return f"{option[1]} = {problems[0]['input']!r}: {advice(problems[0]['type'], problems[0]['msg'])}"


def _unknown_option(name: str, options_here: Sequence[str]) -> str:
    """Message about an option that a command lacks: the one that is meant, or another way to write the value."""
    message = f"No such option: --{name}"
    words = [known.removeprefix("--") for known in options_here]
    begun = [word for word in words if word.startswith(name)]
    if meant := begun or get_close_matches(name, words, 1, _ALIKE):
        return f"{message}; did you mean --{' or --'.join(meant)}?"
    ways = {
        "--set": f"a parameter of the scene is --set '{name}=…'",
        "--engine": f"a setting of an engine goes into brackets: --engine 'NAME[{name}=…]'",
    }
    return "; ".join([message, *(words for known, words in ways.items() if known in options_here)])


# Signals that have interrupted this process.
_signals: list[int] = []


def _interrupt(number: int, _: object) -> None:
    """Signal handler: kills all workers, so that nothing waits for them, and interrupts.

    The next signal ends the process at once.
    """
    _signals.append(number)
    # a module that is being imported lacks it, and has no workers yet
    getattr(sys.modules.get("proofroll.running.process"), "end_all", lambda: None)()
    for signal_name in INTERRUPTS:
        if callable(signal.getsignal(signal_name)):
            signal.signal(signal_name, end_at_once)
    raise KeyboardInterrupt


def _prepare_output() -> None:
    """Opens standard output if a shell closed it (``>&-``), and writes signs that it cannot encode with letters."""
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 -- open to the end
    if isinstance(sys.stdout, io.TextIOWrapper):
        codecs.register_error("signs", spelled_out)
        sys.stdout.reconfigure(errors="signs")


def _name_of(command: Any) -> str:
    """Name of a command or group of commands on the command line."""
    return str(command.name or typer.main.get_command_name(command.callback.__name__))


# Cached: a call of ``app`` would make all commands again, which takes longer than many of them.
@cache
def _made(commands: typer.Typer, named: str = "") -> Any:
    """The commands, or only the one that is ``named``, if there is one, as making all takes a fifth of ``--help``."""
    alone = copy.copy(commands)
    alone.registered_commands = [item for item in commands.registered_commands if _name_of(item) == named]
    alone.registered_groups = [item for item in commands.registered_groups if item.name == named]
    is_one = commands.registered_callback and (alone.registered_commands or alone.registered_groups)
    made: Any = typer.main.get_command(alone if is_one else commands)
    groups = [made]
    for group in groups:  # the list grows meanwhile
        for command in group.commands.values():
            sentence = (command.help or "").partition("\n\n")[0].partition(". ")[0]
            command.short_help = f"{sentence.removesuffix('.')}."  # or typer cuts it
            groups += [command] if hasattr(command, "commands") else []
    return made


def main(commands: typer.Typer = app) -> None:
    """Entry point: every problem is one line on standard error and an exit code.

    Args:
        commands: by default those of proofroll; a package for maintainers has its own.
    """
    _prepare_output()
    for number in INTERRUPTS:  # a time limit from outside and the end of the terminal also end the workers
        if signal.getsignal(number) is not signal.SIG_IGN:  # a shell or nohup may have set it to be ignored
            signal.signal(number, _interrupt)
    warnings.simplefilter("ignore", RuntimeWarning)  # of overflows: their consequences are reported
    _signals.clear()
    try:
        if not all(map(str.strip, sys.argv[1:])):
            raise InputError("argument", "", "this is empty; give a value, or leave the option out")
        code = _made(commands, *sys.argv[1:2] or [""])(standalone_mode=False)
        sys.stdout.flush()  # raises here if the disk is full
    except BaseException as error:  # an import that a signal broke off raises what it likes
        code = INTERRUPTED if _signals else _reported(error)
    for warning in broken.values():
        complain(warning)
    if code == INTERRUPTED:
        stores = sys.modules.get("proofroll.running.store")  # imported by commands that keep results
        kept = stores is not None and stores.Store.opened
        complain("interrupted" + "; cases that were finished and stored will be reused" * kept)
    sys.exit(code or OK)


def _reported(error: BaseException) -> Any:
    """Exit code for an error, after a line about it; raises it if neither the user nor the machine caused it."""
    if isinstance(error, typer.TyperException):
        if error.format_message().startswith("Usage:"):  # a group of commands was called without a command
            sys.stdout.write(f"{error.format_message()}\n")
        else:
            complain(_usage_message(error))
        return USAGE
    if isinstance(error, InputError):
        complain(str(error))
        return USAGE
    if isinstance(error, ProofrollError):
        from proofroll.core.errors import Refused
        from proofroll.running.process import WorkerDied

        complain(str(error))
        return ENGINE if isinstance(error, (Missing, WorkerDied, Refused)) else USAGE
    if isinstance(error, (KeyboardInterrupt, typer.Abort)):
        return INTERRUPTED
    if isinstance(error, (OSError, SystemExit)):
        return _unwritten(error)
    raise error


def _unwritten(error: OSError | SystemExit) -> Any:
    """Exit code if output cannot be written; a pipe closed by its reader is no error."""
    if isinstance(error, SystemExit):
        if not isinstance(error.__context__, BrokenPipeError):
            return error.code  # exit code of a command
        error = error.__context__  # typer turns a broken pipe into a failure
    # Python would write the rest of its buffers at exit and fail again
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    if isinstance(error, BrokenPipeError):
        return OK
    fault = f"{error.filename!s:.300} cannot be used" if error.filename else "the output cannot be written"
    complain(f"{fault} ({error.strerror or error})")
    return USAGE
