"""Tables of results: for a notebook, with a small drawing in each row, and for a terminal."""

import math
from collections.abc import Iterable, Sequence
from html import escape

_DECADES, _WIDTH, _HEIGHT = 6, 120, 14  # decades on each side of the tolerance; size of a gauge [pixels]


def gauge(error: float, tolerance: float) -> str:
    """SVG of an error on a logarithmic axis with the tolerance in its middle, clipped to the axis."""
    ratio = error / tolerance
    decades = _DECADES if not ratio < math.inf else math.log10(max(ratio, 1e-300))
    x = _WIDTH * (0.5 + 0.45 * min(max(decades / _DECADES, -1), 1))
    color, middle, words = "#2e7d32" if ratio <= 1 else "#c62828", _WIDTH / 2, f"{ratio:.2g} of the tolerance"
    return (
        f'<svg role="img" width="{_WIDTH}" height="{_HEIGHT}"><title>{words}</title>'
        f'<line x1="0" x2="{_WIDTH}" y1="7" y2="7" stroke="#999"/>'
        f'<line x1="{middle:g}" x2="{middle:g}" y1="0" y2="{_HEIGHT}" stroke="#999"/>'
        f'<circle cx="{x:.4g}" cy="7" r="4" fill="{color}"/></svg>'
    )


def html_table(
    head: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    notes: Iterable[str] = (),
    *,
    gauges: Iterable[str] = (),
) -> str:
    """HTML of a heading, a table whose first column names the rows, and a paragraph for each note.

    Args:
        head: the heading.
        columns: names of the columns.
        rows: texts of the cells.
        notes: texts of the paragraphs.
        gauges: SVG for a last column, one for each row; may be empty.
    """
    drawn = list(gauges)
    header = "".join(f"<th>{escape(name)}</th>" for name in [*columns, *(["error by tolerance"] if drawn else [])])
    body = "".join(
        f"<tr><th>{escape(name)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}"
        f"{f'<td>{drawn[number]}</td>' if drawn else ''}</tr>"
        for number, (name, *cells) in enumerate(rows)
    )
    rest = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<p><b>{escape(head)}</b></p><table><tr>{header}</tr>{body}</table>{rest}"


def text_table(columns: Sequence[str], rows: Sequence[Sequence[str]], most: int = 40) -> list[str]:
    """Lines of a table for a terminal; a text of more than ``most`` characters is cut, but the last of a row."""
    cut = [[*(text if len(text) <= most else f"{text[: most - 1]}…" for text in row[:-1]), row[-1]] for row in rows]
    lines = [list(columns), *cut]
    widths = [max(len(line[place]) for line in lines) for place in range(len(columns))]
    return ["  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip() for line in lines]
