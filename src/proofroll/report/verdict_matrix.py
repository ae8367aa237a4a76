"""The matrix of verdicts: for each setting and observable a cell with verdict, error and a link to its evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from proofroll.report.labels import SYMBOLS, detail, error, number, setting, step, symbol, unit, unjudged, verdict_text
from proofroll.report.tables import QuantityColumn, cost_title, observables

if TYPE_CHECKING:
    from collections.abc import Mapping

    from proofroll.core.verdict import Judgement, Verdict
    from proofroll.report.comparison_records import ReportedComparison, ReportedRow, ReportedRun
    from proofroll.report.evidence import Cost


@dataclass(frozen=True)
class Cell:
    """One number of a matrix, with a link to its evidence and all about it as a title."""

    verdict: Verdict
    symbol: str
    text: str
    href: str
    title: str


@dataclass(frozen=True)
class MatrixLine:
    """One row of a matrix; ``cells`` in the order of the columns, None where an engine does not say."""

    engine: str
    name: str
    setting: str
    step: str
    verdict: Verdict
    symbol: str
    verdict_text: str
    detail: str
    href: str
    message: str
    as_expected: bool
    seconds: float | None
    cost: str
    cells: list[Cell | None]


@dataclass(frozen=True)
class Matrix:
    """Rows by engine."""

    columns: list[QuantityColumn]
    groups: dict[str, list[MatrixLine]]


def anchor(comparison: int, row: int, point: int) -> str:
    """Id of the evidence of one row at one point."""
    return f"c{comparison}-r{row}-p{point}"


def overview(content: ReportedComparison, comparison: int) -> Matrix:
    """The verdict matrix: the worst of every row over all points."""
    points = list(dict.fromkeys(run.point for run in content.runs))
    columns, lines = observables(content), []
    for index, row in enumerate(content.rows):
        runs = content.runs_of(index)
        worst = next((run for run in runs if run.verdict == row.verdict), runs[0])
        slowest = (run.cost for run in runs if run.cost and run.seconds_per_second == row.seconds_per_second)
        judged = {
            name: _cell(item, anchor(comparison, index, points.index(item.point)), item.point)
            for name, item in row.observables.items()
        }
        href = anchor(comparison, index, points.index(worst.point))
        shown = (verdict_text(row), href, row.message, row.as_expected, next(slowest, None))
        lines.append(_line(row, columns, judged, *shown))
    return _matrix(columns, lines)


def counted(content: ReportedComparison) -> str:
    """How many settings have which verdict, in one line."""
    verdicts = [row.verdict.value for row in content.rows]
    said = ", ".join(f"{sign} {verdicts.count(word)} {word}" for word, sign in SYMBOLS.items() if word in verdicts)
    found = "nothing is contradicted" if unjudged(content) else "as expected"
    return f"{len(verdicts)} settings: {said}; {found if content.as_expected else 'not as expected'}"


def at_point(content: ReportedComparison, comparison: int, point: int, name: str) -> Matrix:
    """The verdict matrix of one point of the parameters."""
    columns, lines = observables(content), []
    for run in content.runs:
        if run.point == name:
            href = anchor(comparison, run.row, point)
            judged = {judgement.observable: _cell(judgement, href) for judgement in run.judgements}
            message = run.message if run.status != "done" else ""
            lines.append(_line(run, columns, judged, run.verdict, href, message, not run.contradictions, run.cost))
    return _matrix(columns, lines)


def _limit(judgement: Judgement) -> str:
    """What the ladder of steps says, with its numbers; nothing where there is none."""
    if judgement.limit_error_bar is None:
        return ""
    off = f"{error(judgement.limit_error)} ± {error(judgement.limit_error_bar, 1)}"
    return f"; {judgement.limit}: off by {off}, order {number(judgement.order)}"


def _cell(judgement: Judgement, href: str, point: str = "") -> Cell:
    where = f" at {point}" if point else ""
    title = (
        f"{symbol(judgement.observable)} {judgement.verdict}: error {error(judgement.error)} ± "
        f"{number(judgement.truth_error_bar, 1)} {unit(judgement.unit)}, tolerance {number(judgement.tolerance)}{where}"
        f"{_limit(judgement)}"
    )
    return Cell(judgement.verdict, SYMBOLS[judgement.verdict], error(judgement.error), href, title)


def _line(
    of: ReportedRow | ReportedRun,
    columns: list[QuantityColumn],
    judged: Mapping[str, Cell],
    text: str,
    href: str,
    message: str,
    as_expected: bool,
    cost: Cost | None,
) -> MatrixLine:
    cells = [judged.get(column.name) for column in columns]
    said = (text, detail(of), href, message, as_expected, of.seconds_per_second, cost_title(cost) if cost else "")
    size = step(of.resolution, of.resolution_value)
    return MatrixLine(of.engine, of.name, setting(of), size, of.verdict, SYMBOLS[of.verdict], *said, cells)


def _matrix(columns: list[QuantityColumn], lines: list[MatrixLine]) -> Matrix:
    """The lines grouped by engine."""
    groups: dict[str, list[MatrixLine]] = {}
    for line in lines:
        groups.setdefault(line.name, []).append(line)
    return Matrix(columns, groups)
