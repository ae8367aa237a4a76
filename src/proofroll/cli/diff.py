"""Command ``diff``: what changed between two reports, two runs, or two versions of an engine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError


def diff(
    old: Annotated[str, typer.Argument(help="A report.json or its folder, a run (.nc, .npz), or NAME@VERSION.")],
    new: Annotated[str, typer.Argument(help="What it is compared with, of the same kind.")],
    comment: options.Comment = None,
    as_json: options.Json = False,
) -> None:
    """Show what changed between two reports, two runs of a scene, or two versions of an engine; exit 1 if anything did.

    Of reports: verdicts, errors beyond both error bars, costs beyond both intervals, runs that are gone. Of runs that
    `proofroll run --out` wrote: every quantity, at the instants that both have. Versions of an engine run the same
    cases, as `proofroll versions` does, which has more options.
    """
    from proofroll.core.plugins import place_of, plain_name
    from proofroll.files.trajectory_file import CSV, NETCDF, STORED
    from proofroll.report.changes import EarlierReport
    from proofroll.report.terminal.screen import WIDTH

    if any(place_of(text) and not Path(text).exists() for text in (old, new)):
        from proofroll.cli.versions import versions

        engine = plain_name(old)
        if engine != plain_name(new):
            raise InputError("new", new, f"is no version of {engine}; name two of one engine, as {engine}@VERSION")
        if comment is not None:
            raise InputError("--comment", comment, "it is for reports and runs; versions have a page of their own")
        versions(engine, place_of(old) or engine, place_of(new) or engine, as_json=as_json)
    are_runs = [Path(text).suffix in (NETCDF, STORED) for text in (old, new)]
    for text in (old, new):
        if Path(text).suffix == CSV:
            raise InputError("run", text, f"names no scene; write it as {NETCDF} or {STORED}, or judge it")
    if any(are_runs) != all(are_runs):
        raise InputError("new", new, f"is of another kind than {old}; name two reports or two runs")
    if comment is not None:
        options.require_writable(comment, "--comment")
    if all(are_runs):
        from proofroll.studies.versions.two_runs import two_runs

        runs = two_runs(Path(old), Path(new))
        changed, lines, markdown = runs.changed, [runs.sentence, *runs.lines], runs.markdown
        content: object = runs
    else:
        earlier, later = (EarlierReport.read(Path(text), name) for name, text in (("old", old), ("new", new)))
        reports = later.against(earlier)
        changed, lines, markdown = reports.changed, reports.lines, reports.markdown
        content = reports
    if comment is not None:
        from proofroll.running.store import write_text

        write_text(comment, markdown)
    options.show(content, as_json, lambda: lines, widest=WIDTH)
    raise typer.Exit(options.CONTRADICTED if changed else options.OK)
