"""Verdict table and other tables for the terminal, within 100 columns."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import counted, number
from proofroll.report.comparison.closing import closing_notes
from proofroll.report.comparison.spread import ALONE
from proofroll.report.comparison.tables import observables, remarks, seconds_before
from proofroll.report.labels import (
    SYMBOLS,
    engine_title,
    engine_words,
    omitted_lines,
    step,
    unit,
    unjudged,
    verdict_text,
)
from proofroll.report.page.answer import answer, speed_words, told
from proofroll.report.parts import part_kinds
from proofroll.report.terminal.screen import Screen, numeric, plain_table, unbroken
from proofroll.running.case import Status, host_sentences

if TYPE_CHECKING:
    from collections.abc import Iterator

    from proofroll.report.changes import Against
    from proofroll.report.comparison.records import ReportedComparison, WorstJudgement
    from proofroll.report.comparison.spread import Spread
    from proofroll.report.page.choice_matrix import ChoiceMatrix
    from proofroll.report.page.records import ReportContent

WIDTH = 100
_WIDEST = 8  # largest number of spreads that are listed
_WORD, _NUMBER = 14, 7  # characters of the longest word and of a number
STYLES = {
    "agrees": "green",
    "unconfirmed": "yellow",
    "incomplete": "yellow",
    "converges": "yellow",
    "ill-posed": "cyan",
    "not-judged": "cyan",
    "another-scene": "cyan",
    "refused": "magenta",
    "differs": "red",
    "failed": "bold red",
}


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


def verdict_table(content: ReportedComparison) -> Table:
    """Table with a line per engine with settings: the worst over all points of the parameters."""
    names, seconds = columns(content), seconds_before(content)
    worst = [
        max((row.observables[name] for name, _ in names if name in row.observables), key=_beyond, default=None)
        for row in content.rows
    ]
    numbers = {
        "order": [item.order if item else None for item in worst],
        "s before": [seconds.get(index) for index in range(len(content.rows))],
        "s/s": [row.seconds_per_second for row in content.rows],
    }
    numbers = {name: column for name, column in numbers.items() if any(value is not None for value in column)}
    table = plain_table(
        # In a narrow window columns with a least width wrap between words, and nothing is cut.
        Column("engine formulation setting", min_width=_WORD, overflow="fold"),
        *unbroken("step"),
        Column("verdict", min_width=_WORD),
        *(Column(Text(f"{name} [{unit}]"), justify="right", min_width=_NUMBER) for name, unit in names),
        *numeric(*numbers),
        *unbroken(""),
        title=content.title,
    )
    for index, row in enumerate(content.rows):
        verdict, judged = row.verdict, row.observables
        table.add_row(
            Text(" ".join(filter(None, (engine_words(row.name, row.formulation), row.setting)))),
            step(row.resolution, row.resolution_value),
            Text(f"{SYMBOLS[verdict]} {verdict_text(row, content.runs_of(index))}", style=STYLES[verdict]),
            *(number(judged[name].error if name in judged else None) for name, _ in names),
            *(number(column[index]) for column in numbers.values()),
            Text("") if row.as_expected else Text("!!", style="bold red"),
        )
    return table


def _beyond(item: WorstJudgement) -> float:
    """Error in units of its tolerance; 0 if it is not finite, so that finite errors rank first."""
    return item.error / item.tolerance if math.isfinite(item.error) else 0.0


def columns(content: ReportedComparison) -> list[tuple[str, str]]:
    """(name, unit) of the observables shown on a terminal: headline motions, and the first headline reaction."""
    units = observables(content)
    shown = [name for name in content.headlines("motion") if name in units]
    shown += [name for name in content.headlines("reaction") if name in units][:1]
    return [(name, units[name]) for name in shown]


def verdict_parts(content: ReportedComparison) -> Iterator[Table | str]:
    """Parts of a comparison's text: the verdict table, spreads, and closing lines; or why no run was made."""
    if content.unreached and content.budget is None:
        yield from (content.title, content.unreached, *omitted_lines(content.omitted), "")
        return
    yield from omitted_lines(content.omitted)
    if content.step_bound:
        yield f"{content.step_bound}."
    yield verdict_table(content)
    yield from dash_notes(content)
    for item in content.spread:
        yield from spread_parts(item)
    yield from closing_lines(content)
    yield ""


def dash_notes(content: ReportedComparison) -> list[str]:
    """Line below the verdict table on what its dashes mean; none where it has no dash."""
    shown = [name for name, _ in columns(content)]
    judged = [[row.observables[name] for name in shown if name in row.observables] for row in content.rows]
    with_orders = any(item.order is not None for items in judged for item in items)
    notes = []
    if any(len(items) < len(shown) or any(not math.isfinite(item.error) for item in items) for items in judged):
        notes.append("no value, see the reason of the row")
    if with_orders and any(items and max(items, key=_beyond).order is None for items in judged):
        notes.append("no order is measured where errors are round-off or the step is not varied")
    return [f"–: {'; '.join(notes)}."] if notes else []


def spread_parts(spread: Spread) -> Iterator[Table | str]:
    """Table of the spread of final values at a point without a unique truth, the widest first."""
    place = f" at {spread.point}" if spread.point else ""
    yield f"{ALONE[0].upper()}{ALONE[1:]}{place}: {spread.because}."
    if spread.lines:
        table = plain_table(Column("spread of the settings"), *numeric("lowest", "highest"), *unbroken("unit"))
        for line in sorted(spread.lines, key=lambda line: -line.part)[:_WIDEST]:
            table.add_row(line.name, number(line.low, 4), number(line.high, 4), unit(line.unit))
        yield table
    if len(spread.lines) > _WIDEST:
        yield f"Narrower spreads, in the report and its JSON: {len(spread.lines) - _WIDEST}."


def closing_lines(content: ReportedComparison) -> list[str]:
    """Closing lines of a comparison: counts, reasons, remarks, contradictions, and shared schemes."""
    rows = content.rows
    counts = {verdict: sum(row.verdict == verdict for row in rows) for verdict in SYMBOLS}
    totals = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    lines = [f"{counted(len(rows), 'engine settings')}, {counted(len(content.runs), 'runs')} in all: {totals}."]
    lines += content.truth_ends
    for name, row, _ in content.lines():
        if row.reason and not row.reason.startswith(Status.LEFT_OUT):
            lines.append(f"{SYMBOLS[row.verdict]} {name}: {row.reason}")
        lines += [f"  {told.sentence}: {told.cause.remedy}" for told in row.diagnosis]
    lines += [f"* {name}: {remark}" for name, remark in remarks(content)]
    if content.contradictions:
        count = len(content.contradictions)
        contradict = "1 result contradicts" if count == 1 else f"{count} results contradict"
        lines.append(f"{contradict} what {content.name} expects (!! above){'; first' if count > 5 else ''}:")
        lines += [f"  {sentence}" for sentence in content.contradictions[:5]]
    elif content.claims:
        left = unjudged(content)
        lines.append(
            f"Nothing contradicts the comparison file; {left} of its runs could not be judged."
            if left
            else "Every verdict is as the comparison file expects."
        )
    if content.unjudged:
        told = ", ".join(content.unjudged)
        lines.append(f"Not judged: {told} (a comparison file judges them: proofroll new comparison).")
    unfit = "; ".join(f"{engine_title(name)} ({why})" for name, why in content.unfit.items())
    lines += [f"Not in the table: {unfit}."] if unfit else []
    return [*lines, *budget_lines(content), *closing_notes(content), *host_sentences(content.hosts)]


def budget_lines(content: ReportedComparison) -> list[str]:
    """Lines on cases left out for lack of processor time, and the command that runs them."""
    left = content.beyond_budget
    if not left:
        return []
    more = f" and {len(left) - 1} more" if len(left) > 1 else ""
    if content.budget is None:
        return [f"Left out for lack of processor time: {left[0]}{more}."]
    seconds = f"{content.budget:g} s of processor time, building and compiling included,"
    left_out = f"Left out, for {seconds} did not suffice: {left[0]}{more}."
    again = "" if left[0].startswith("the truth") else "The same command continues with the rest; "
    return [f"{left_out} {again}--budget {10 * content.budget:g} gives it more time."]


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
