"""Lines and tables of a report and of findings on the terminal."""

from __future__ import annotations

from itertools import zip_longest
from typing import TYPE_CHECKING

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import counted
from proofroll.core.verdict import Verdict
from proofroll.report.labels import SYMBOLS
from proofroll.report.parts import part_kinds
from proofroll.report.terminal.screen import WIDTH, plain_table, unbroken
from proofroll.report.terminal.verdicts import verdict_of
from proofroll.studies.findings import FindingState

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from proofroll.report.comparison.records import ReportedComparison
    from proofroll.report.page.records import ReportContent
    from proofroll.running.time_budget import ProcessorProfile
    from proofroll.studies.findings import EngineFinding, Shown

_STYLES = {
    FindingState.SHOWS: "red",
    FindingState.GONE: "green",
    FindingState.NOT_INSTALLED: "dim",
    FindingState.BROKEN: "yellow",
}
_FINE = (Verdict.AGREES, Verdict.UNCONFIRMED, Verdict.INCOMPLETE)


def profile_lines(profile: ProcessorProfile) -> Iterator[str]:
    """Processor-seconds of a report by phase, and those of its cases by activity, the longest first."""
    yield f"processor-seconds: {profile.total:.0f}"
    for title, seconds in (("by phase", profile.phases), ("in cases", profile.activities)):
        longest = sorted(seconds.items(), key=lambda item: -item[1])
        yield f"{title}: {', '.join(f'{name} {value:.1f}' for name, value in longest)}"


def report_lines(content: ReportContent, out: Path) -> Iterator[str]:
    """Lines of a report: the answer, what to look at first, a count for each comparison, further studies, files."""
    rows = [row for item in content.comparisons for row in item.rows]
    answers = content.answers
    yield from (f"{x.words}: {x.sentence}" for x in answers if x.answer.tolerance == answers[0].answer.tolerance)
    agree = sum(row.verdict is Verdict.AGREES for row in rows)
    sentence, *others = first_lines(content)
    counts = f"{agree} of {counted(len(rows), 'settings')} {'agrees' if agree == 1 else 'agree'}. " if rows else ""
    yield f"{counts}{sentence}"
    yield from (*others, "", *comparison_lines(content.comparisons), "")
    yield from part_lines(content)
    yield from content.against.lines if content.against else ()
    yield from filter(None, [content.beyond_budget, content.omission_sentences])
    expected = rows and all(item.as_expected for item in content.comparisons)
    yield f"{'All as expected. ' if expected else ''}{out / 'report.html'} · report.json · report.csv"
    if any(row.verdict not in _FINE for row in rows):
        yield "Why a setting differs or fails: proofroll compare NAME"


def comparison_lines(comparisons: Sequence[ReportedComparison]) -> list[str]:
    """Count of the settings that agree, name, and counts of other verdicts of each comparison; in two columns if short.

    The first sign says whether all is as expected.
    """
    entries, longest = [], max((len(item.name) for item in comparisons), default=0)
    for item in comparisons:
        verdicts = [verdict_of(row) for row in item.rows]
        signs = [f"{SYMBOLS[word]} {verdicts.count(word)}" for word in list(Verdict)[1:] if word in verdicts]
        count = f"{'✓' if item.as_expected else '✗'} {verdicts.count(Verdict.AGREES):>2} of {len(verdicts):>2}"
        entries.append(f"{count}  {item.name:{longest}}  {' '.join(signs)}")
    width = max(map(len, entries), default=0) + 2
    if 2 * width > WIDTH:
        return [entry.rstrip() for entry in entries]
    half = (len(entries) + 1) // 2
    return [
        f"{left:{width}}{right}".rstrip() for left, right in zip_longest(entries[:half], entries[half:], fillvalue="")
    ]


def part_lines(content: ReportContent) -> list[str]:
    """One line for each further study of a report."""
    pairs = [(kind, entry) for kind in part_kinds() for entry in content.entries[kind.key] if entry.study is not None]
    return [f"{entry.name}: {kind.line(entry)}." for kind, entry in pairs]


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


def findings_table(rows: Sequence[Shown]) -> Table:
    """Table with a line per finding: title, whether it shows in the installed version, output of its program."""
    table = plain_table(*_folded("finding"), *unbroken("state"), *_folded("installed", "said"))
    for row in rows:
        version = f"{row.finding.package} {row.version}".strip() if row.version else ""
        table.add_row(Text(row.finding.title), Text(row.state, style=_STYLES[row.state]), Text(version), Text(row.said))
    return table


def findings_list(findings: Sequence[EngineFinding]) -> Table:
    """Table with a line per finding: title, versions where it was seen, version without it, and public thread."""
    table = plain_table(*_folded("finding", "seen in", "gone in", "issue"))
    for item in findings:
        table.add_row(*(Text(text) for text in (item.title, item.seen, item.gone, item.issue)))
    return table


def _folded(*names: str) -> list[Column]:
    return [Column(name, overflow="fold") for name in names]
