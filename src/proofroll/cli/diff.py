"""Command ``diff``: what changed between two reports, two runs, or two versions of an engine."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError, ProofrollError

if TYPE_CHECKING:
    from proofroll.report.changes import Against, EarlierReport
    from proofroll.running.runner import Runner
    from proofroll.studies.comparison.outcome import Outcome


def diff(
    context: typer.Context,
    old: Annotated[str, typer.Argument(help="A report.json or its folder, a run (.nc, .npz), or ENGINE@VERSION.")],
    new: Annotated[str, typer.Argument(help="What it is compared with, of the same kind.")],
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            help="Of versions: scenes and comparisons; by default all comparisons.", callback=options.own_first
        ),
    ] = None,
    _root: options.Root = None,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    comment: options.Comment = None,
    as_json: options.Json = False,
) -> None:
    """Show what changed between two runs, reports or versions. Exit 1 if anything did, of versions if a verdict did.

    Of reports: verdicts, errors beyond both error bars, costs beyond both intervals, runs that are gone. Of runs that
    `proofroll run --out` wrote: every quantity, at the instants that both have.

    Versions of an engine run the same cases: ENGINE@VERSION, ENGINE@LABEL of `proofroll engines`, ENGINE@PATH of a
    Python, or ENGINE, which is installed here. Environments that are missing are made, as by `proofroll engines add`;
    workers of a cluster need their own. They are compared as two reports are; errors and costs do not decide the exit
    code.
    """
    from proofroll.core.plugins import place_of
    from proofroll.report.terminal.screen import WIDTH

    if comment is not None:
        options.require_writable(comment, "--comment")
    shown: object
    if any(place_of(text) and not Path(text).exists() for text in (old, new)):
        against, lost = _of_versions(old, new, scenes or (), options.new_runner(out, fresh, jobs, scheduler))
        changed = any(item.kind in {"verdict", "gone"} for item in against.changes)
        lines, markdown, shown = against.lines, against.markdown, against
    else:
        options.require_only(context, {"old", "new", "comment", "as_json"}, "this is for two versions of an engine")
        (changed, lines, markdown, shown), lost = _of_files(old, new), False
    if comment is not None:
        from proofroll.running.store import write_text

        write_text(comment, markdown)
    options.show(shown, as_json, lambda: lines, widest=WIDTH)
    raise typer.Exit(options.ENGINE if lost else options.CONTRADICTED if changed else options.OK)


def _of_files(old: str, new: str) -> tuple[bool, list[str], str, object]:
    """Changes between two runs or two reports: if there are any, their lines, Markdown and records."""
    from proofroll.files.trajectory_file import CSV, NETCDF, STORED

    are_runs = [Path(text).suffix in (NETCDF, STORED) for text in (old, new)]
    for field, text in (("old", old), ("new", new)):
        if Path(text).suffix == CSV:
            raise InputError("run", text, f"names no scene; write it as {NETCDF} or {STORED}, or judge it")
        if not Path(text).exists():
            raise InputError(field, text, "there is no such file; give two reports, two runs, or two ENGINE@VERSION")
    if any(are_runs) != all(are_runs):
        raise InputError("new", new, f"is of another kind than {old}; name two reports or two runs")
    if all(are_runs):
        from proofroll.studies.versions.two_runs import two_runs

        runs = two_runs(Path(old), Path(new))
        return runs.changed, [runs.sentence, *runs.lines], runs.markdown, runs
    from proofroll.report.changes import EarlierReport

    earlier, later = (EarlierReport.read(Path(text), name) for name, text in (("old", old), ("new", new)))
    reports = later.against(earlier)
    return reports.changed, reports.lines, reports.markdown, reports


def _of_versions(old: str, new: str, subjects: Sequence[str], runner: Runner) -> tuple[Against, bool]:
    """Changes between the same comparisons in two versions of an engine; an environment that is missing is made.

    Args:
        old: the first version, ``NAME`` or ``NAME@PLACE``.
        new: the second version.
        subjects: scenes and comparisons; none: all comparisons.
        runner: runs the cases.

    Returns:
        The changes, and True if an engine was missing.

    Raises:
        InputError: a name is unknown, the engines are two, or both versions are one.
    """
    from proofroll.core.plugins import place_of, plain_name
    from proofroll.studies.versions.versions import comparisons_about, outcomes_of_versions

    engine = plain_name(old)
    if engine != plain_name(new):
        raise InputError("new", new, f"is no version of {engine}; name two of one engine, as {engine}@VERSION")
    comparisons = comparisons_about(subjects, engine)  # before minutes are spent on environments
    sides = _side(engine, place_of(old) or engine), _side(engine, place_of(new) or engine)
    if sides[0] == sides[1]:
        raise InputError("new", new, f"both are {sides[0]}; name two versions")
    with options.progress_bar("cases") as advance:
        outcomes = outcomes_of_versions(sides, comparisons, runner, advance)
    earlier, later = (_as_report(side, found, runner) for side, found in zip(sides, outcomes, strict=True))
    return later.against(earlier), any(line.status == "missing" for line in (*earlier.lines, *later.lines))


def _as_report(engine: str, outcomes: Sequence[Outcome], runner: Runner) -> EarlierReport:
    """Report of one version, by the engine's plain name; its defaults stand beside its version."""
    from datetime import UTC, datetime

    from proofroll.core.plugins import plain_name
    from proofroll.report.changes import EarlierReport
    from proofroll.report.comparison.lines import lines_of
    from proofroll.running.engine_questions import describe
    from proofroll.running.timing import machine

    told, name = describe(engine, runner.workers), plain_name(engine)
    lines = [replace(line, engine=name) for outcome in outcomes for line in lines_of(outcome)]
    versions = {name: told.version} | {f"default {key}": str(value) for key, value in told.defaults.items()}
    return EarlierReport(
        path=Path(engine),
        date=datetime.now(UTC).isoformat(),
        machine=machine()["processor"],
        versions=versions,
        lines=lines,
    )


def _side(engine: str, text: str) -> str:
    """Engine ``NAME`` or ``NAME@PLACE`` for a version, a label or a path; its environment is made if necessary."""
    from proofroll.core.plugins import engine_names
    from proofroll.running import environments
    from proofroll.running.engine_questions import describe

    if text == engine:
        return engine  # the installed one
    if os.sep in text or text.startswith(("~", ".")) or environments.find(engine, text) is not None:
        return f"{engine}@{text}"
    if not re.fullmatch(r"\d[\w.+]*", text):
        raise InputError("version", text, f"no environment of {engine} has this label; see proofroll engines")
    if engine in engine_names():
        with contextlib.suppress(ProofrollError):  # it is not installed here
            if f"{describe(engine).version}.".startswith(f"{text}."):  # 1.13 means 1.13.6 if that is installed
                return engine
    return _made(engine, text)


def _made(engine: str, version: str) -> str:
    """Makes the environment of a version; returns its engine ``NAME@VERSION``."""
    from proofroll.core.plugins import package_of
    from proofroll.running.make_environment import add

    package = package_of(engine)
    by_hand = f"proofroll engines add {engine} --requirement {package or 'PACKAGE'}=={version}"
    if not package:
        raise InputError("engine", engine, f"no environment of {version} is remembered; {by_hand}")
    options.complain(f"no environment of {engine} {version} is remembered: making one, as {by_hand} does")
    try:
        with options.spinner(f"{engine} {version}") as say:
            add(engine, [f"{package}=={version}"], tell=lambda text: say(f"{engine} {version}: {text}"))
    except InputError:  # a wrong argument, which is wrong by hand, too
        raise
    except ProofrollError as error:
        raise ProofrollError(f"{error}; when that is mended, or with more requirements: {by_hand}") from None
    return f"{engine}@{version}"
