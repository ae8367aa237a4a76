"""The command line. Data goes to standard output, progress and problems to standard error."""

from __future__ import annotations

import signal
import sys
from typing import Annotated, Any

import typer

import proofroll
from proofroll.cli.bench import bench
from proofroll.cli.common import ENGINE, INTERRUPTED, OK, USAGE, complain
from proofroll.cli.comparing import compare, regimes, report
from proofroll.cli.listing import engines, scenes
from proofroll.cli.single import onset, run
from proofroll.errors import InputError, Missing, ProofrollError

app = typer.Typer(
    help="Which multibody engine, formulation and time step can you trust for a scene?",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for _command in (scenes, engines, run, compare, report, onset, regimes):
    app.command()(_command)
app.add_typer(bench, name="bench")


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
        complain(f"{error.format_message()}{_given(error)}")
        code = USAGE
    except InputError as error:
        complain(str(error))
        code = USAGE
    except ProofrollError as error:
        from proofroll.errors import Refused
        from proofroll.runner import WorkerDied

        complain(str(error))
        code = ENGINE if isinstance(error, (Missing, WorkerDied, Refused)) else USAGE
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except BrokenPipeError:
        code = OK  # the reader of our output has seen enough
    if code == INTERRUPTED:
        complain("interrupted; cases of a comparison that were finished are stored and will be reused")
    sys.exit(code or OK)
