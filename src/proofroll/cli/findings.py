"""What was found out about engines, run against what is installed."""

from __future__ import annotations

from typing import Annotated

import typer

from proofroll.cli.options import Json, progress_bar, write_json


def findings(
    engine: Annotated[list[str] | None, typer.Option(help="Only findings about this engine; may be repeated.")] = None,
    python: Annotated[str, typer.Option(help="Interpreter that has the engines, instead of this one.")] = "",
    listed: Annotated[bool, typer.Option("--list", help="Tell them, with remedies, without running anything.")] = False,
    time_limit: Annotated[float, typer.Option(help="Wall seconds after which a program is ended.")] = 300.0,
    as_json: Json = False,
) -> None:
    """Run what was found out about engines against what is installed: what still shows, and what is gone."""
    import dataclasses

    from proofroll.report.findings_table import findings_list, findings_table
    from proofroll.report.terminal import console
    from proofroll.studies.findings import FindingState, load_findings, shown

    wanted = load_findings(engine or [])
    if listed:
        if as_json:
            write_json({"findings": [dataclasses.asdict(item) for item in wanted]})
        else:
            console().print(findings_list(wanted))
        return
    rows = []
    with progress_bar("findings", total=len(wanted)) as advance:
        for row in shown(wanted, python, time_limit):
            rows.append(row)
            advance(row.finding.name)
    counts = {state.value: sum(row.state == state for row in rows) for state in FindingState}
    if as_json:
        told = [
            {**dataclasses.asdict(row.finding), "state": row.state.value, "version": row.version, "said": row.said}
            for row in rows
        ]
        write_json({"counts": counts, "findings": told})
    else:
        console().print(findings_table(rows))
        shares = ", ".join(f"{name} {count}" for name, count in counts.items() if count)
        console().print(f"Of {len(rows)} findings: {shares}.")
