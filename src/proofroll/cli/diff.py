"""Command ``diff``: what changed between two reports, two runs, or two versions of an engine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError


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
        from proofroll.cli.versions import versions

        against, lost = versions(old, new, scenes or (), options.new_runner(out, fresh, jobs, scheduler))
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
