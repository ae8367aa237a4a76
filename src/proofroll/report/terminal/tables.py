"""Console of the terminal, and closing lines and tables of a report."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from rich.table import Column, Table
from rich.text import Text

from proofroll.report.page.answer import answer, speed_words, told
from proofroll.report.parts import part_kinds
from proofroll.report.terminal.screen import Screen, numeric, plain_table

if TYPE_CHECKING:
    from proofroll.report.changes import Against
    from proofroll.report.page.choice_matrix import ChoiceMatrix
    from proofroll.report.page.records import ReportContent

WIDTH = 100
_WORD = 14  # characters of the longest word


def console() -> Screen:
    """Console for data on standard output: at most 100 columns of a terminal; in a pipe 100, or COLUMNS.

    Text is printed literally: ``[words]`` and ``:words:`` are not markup.
    """
    out = Screen(highlight=False, markup=False, emoji=False)
    if out.is_terminal:
        out.width = min(out.width, WIDTH)
    elif not os.environ.get("COLUMNS", "").isdecimal():  # else rich has read it
        out.width = WIDTH
    out.width = out.width or 80  # COLUMNS=0 means unknown
    return out


def part_lines(content: ReportContent) -> list[str]:
    """One line for each further study of a report."""
    pairs = [(kind, entry) for kind in part_kinds() for entry in content.entries[kind.key] if entry.study is not None]
    return [f"{entry.name}: {kind.line(entry)}." for kind, entry in pairs]


def change_lines(changes: Against | None) -> list[str]:
    """Changes since an earlier report, a line for all runs with the same change; empty without an earlier report."""
    if changes is None:
        return []
    head = f"Against {changes.old} of {changes.date[:10]}. {changes.sentence}"
    versions = [f"{name} {old} → {new}" for name, (old, new) in changes.versions.items()]
    lines = [f"Other versions: {', '.join(versions)}."] if versions else []
    runs: dict[str, list[str]] = {}
    for item in changes.changes:
        place = f" at {item.place}" if item.place else ""
        runs.setdefault("; ".join(item.says) or item.kind, []).append(f"{item.study}: {item.run}{place}")
    for change, where_seen in runs.items():
        several = f" ({len(where_seen)} runs)" if len(where_seen) > 1 else ""
        lines.append(f"!! {'; '.join(where_seen)}: {change}{several}")
    return [head, *lines]


def first_lines(content: ReportContent) -> list[str]:
    """Opening sentences, at most three, on what to look at first; the terminal wraps them."""
    entries = content.further
    unexpected = [line for comparison in content.comparisons for line in comparison.contradictions]
    unexpected += [line for entry in entries for line in entry.contradictions]
    missing = [entry for entry in entries if entry.missing]
    lines = []
    if unexpected:
        lines.append(_one_line(f"Look first at the unexpected result ({len(unexpected)}): {unexpected[0]}"))
    if missing:
        lines.append(_one_line(f"Missing ({len(missing)}): {missing[0].title}: {missing[0].missing}"))
    if not unexpected:
        lines.append(_one_line(content.findings[1]))
    return lines


def _one_line(text: str) -> str:
    """Text without line breaks, which quoted messages may have."""
    return " ".join(text.split())


def answer_table(matrix: ChoiceMatrix, tolerance: float, forces: bool, *, scenes: bool = False) -> Table:
    """The answer of the first screen: for each kind of scenes, or each scene, what to take, its speed, and the next."""
    answered = answer(matrix, tolerance, forces)
    table = plain_table(
        Column("scene" if scenes else "kind of scene", min_width=_WORD),
        Column("take", min_width=_WORD),
        *numeric("× real time"),
        Column("next engine", min_width=_WORD),
        *([] if forces else [Column("if forces count", min_width=_WORD)]),
        title=f"The cheapest that holds {answered.question.words}",
    )
    for item in answered.scenes if scenes else answered.kinds:
        taken = item.taken
        table.add_row(
            Text(item.column.title),
            Text(told(matrix, taken) if taken else item.closest_words),
            Text(speed_words(taken) if taken else "–"),
            Text("; ".join([item.next_words, *item.exceptions])),
            *([] if forces else [Text(item.forces_words)]),
        )
    return table
