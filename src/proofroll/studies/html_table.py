"""A table of results as a notebook shows it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def html_table(head: str, columns: Sequence[str], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """HTML of a heading, a table whose first column names the rows, and a paragraph for each note; all are texts."""
    header = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join(
        f"<tr><th>{escape(name)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for name, *cells in rows
    )
    rest = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<p><b>{escape(head)}</b></p><table><tr>{header}</tr>{body}</table>{rest}"
