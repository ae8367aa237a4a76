"""Commands ``scenes``, ``findings`` and ``cite``: lists of scenes, of findings about engines, and of references."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from proofroll.cli import options
from proofroll.core.limits import PROGRAM_TIME_LIMIT
from proofroll.core.number_format import counted

if TYPE_CHECKING:
    from rich.table import Table

    from proofroll.files.scene_file import SceneFile


def scenes(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Scene of which all parameters are listed.",
            autocompletion=options.scenes_like,
            callback=options.own_first,
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """List the scenes, or the parameters of one scene."""
    from proofroll.files.scene_file import read_scene_file, scene_names, scene_titles

    if name is None and not as_json:
        options.show(None, as_json, lambda: _titles(scene_titles()))
        return
    files = {scene: read_scene_file(scene) for scene in (scene_names() if name is None else [name])}
    content = [
        {"name": name, "title": file.title, "source": file.source, "parameters": file.parameters}
        for name, file in files.items()
    ]
    options.show(content, as_json, lambda: _tables(files))


_LINE = 80  # characters


def _titles(titles: Mapping[str, str]) -> Iterator[str]:
    """Lines of name and title for each scene; a title that is too long is cut at a comma or colon."""
    wide = max(map(len, titles))
    for name, title in titles.items():
        line = f"{name:{wide}}  {title}"
        yield line if len(line) <= _LINE else re.split("[,:]", line)[0]
    yield "proofroll scenes NAME lists the parameters of one."


def _tables(files: Mapping[str, SceneFile]) -> Iterator[Table | str]:
    from rich.table import Table

    for name, file in files.items():
        columns = ("parameter", "symbol", "default", "unit", "meaning")
        table = Table(*columns, title=f"{name}: {file.title}", title_justify="left", box=None, pad_edge=False)
        for key, item in file.parameters.items():
            value = item.value if isinstance(item.value, str) else f"{item.value:g}"
            table.add_row(key, item.symbol, value, item.unit, item.meaning)
        yield from (table, "")


def findings(
    engine: Annotated[list[str] | None, typer.Option(help="Only findings about this engine; may be repeated.")] = None,
    python: Annotated[str, typer.Option(help="Interpreter that has the engines, instead of this one.")] = "",
    listed: Annotated[bool, typer.Option("--list", help="Tell them, with remedies, without running anything.")] = False,
    time_limit: Annotated[
        float, typer.Option(help="Wall seconds after which a program is ended.")
    ] = PROGRAM_TIME_LIMIT,
    as_json: options.Json = False,
) -> None:
    """Run the programs of the findings: which still show. They run with the installed engines."""
    import dataclasses

    from proofroll.report.terminal.tables import findings_list, findings_table
    from proofroll.studies.findings import FindingState, load_findings, run_findings

    chosen = load_findings(engine or [])
    if listed:
        content: dict[str, Any] = {"findings": [dataclasses.asdict(item) for item in chosen]}
        options.show(content, as_json, lambda: [findings_list(chosen)])
        return
    rows = []
    with options.progress_bar("findings", total=len(chosen)) as advance:
        for row in run_findings(chosen, python, time_limit):
            rows.append(row)
            advance(row.finding.name)
    counts = {state.value: sum(row.state == state for row in rows) for state in FindingState}
    records = [
        {**dataclasses.asdict(row.finding), "state": row.state.value, "version": row.version, "said": row.said}
        for row in rows
    ]
    shares = ", ".join(f"{name} {count}" for name, count in counts.items() if count)
    content = {"counts": counts, "findings": records}
    options.show(content, as_json, lambda: [findings_table(rows), f"Of {counted(len(rows), 'findings')}: {shares}."])


def cite(
    subject: Annotated[
        list[str] | None,
        typer.Argument(help="Results (.json of a command, .nc of a run), comparisons, scenes, or engines."),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Print the references behind a result in BibTeX. They are of engines, scene, truth and proofroll."""
    from dataclasses import asdict

    from proofroll.studies.citing import citations

    cited = citations(subject or [])
    if as_json:
        options.write_json({"cited": [asdict(item) for item in cited]})
        return
    shown: set[str] = set()
    for item in cited:
        fresh = [entry for entry in item.references if entry not in shown]
        shown.update(fresh)
        lines = fresh if item.references or item.source else ["% no reference is known; see its own documentation"]
        sys.stdout.write("\n".join([f"% {item.heading}{': ' + item.source if item.source else ''}", *lines, "\n"]))
