"""Command ``cite``: references for a result."""

import sys
from typing import Annotated

import typer

from proofroll.cli import options


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
