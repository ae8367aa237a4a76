"""Command ``findings``: runs findings about engines against the installed versions."""

from typing import Annotated, Any

import typer

from proofroll.cli import options
from proofroll.core.limits import PROGRAM_TIME_LIMIT
from proofroll.core.number_format import counted


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
