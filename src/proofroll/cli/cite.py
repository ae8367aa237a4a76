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
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print BibTeX instead of sentences.")] = False,
    as_json: options.Json = False,
) -> None:
    """Print the references behind a result: engines with their versions, the scene, the truth, and proofroll itself."""
    from proofroll.studies.citing import citations, content, sentence

    cited = citations(subject or [])
    if as_json:
        options.write_json({"cited": content(cited)})
        return
    shown: set[str] = set()
    lines = []
    for item in cited:
        if bibtex:
            fresh = [entry for entry in item.references if entry not in shown]
            shown.update(fresh)
            lines += [f"% {item.heading}{': ' + item.source if item.source else ''}", *fresh, ""]
            continue
        lines += [item.heading, *([f"  {item.source}"] if item.source else [])]
        lines += [f"  {sentence(entry)}" for entry in item.references]
        lines += [] if item.references or item.source else ["  no reference is known; see its own documentation"]
    if bibtex:
        sys.stdout.write("".join(f"{line}\n" for line in lines))
    else:
        options.show_lines(lines)
