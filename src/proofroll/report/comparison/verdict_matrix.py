"""Matrix of verdicts: a cell for each setting and observable, with verdict, error and a link to its evidence."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from proofroll.core.diagnosis.scene_diagnosis import Diagnosis
from proofroll.core.number_format import counted as plural
from proofroll.core.number_format import error, number
from proofroll.core.verdict import Judgement, Verdict
from proofroll.report.comparison.records import Cost, ReportedComparison, ReportedRow, ReportedRun
from proofroll.report.comparison.tables import observables, seconds_before
from proofroll.report.labels import SYMBOLS, symbol, unit, unjudged, verdict_text, verdict_word

# Verdicts whose reason stands in the row: there are no numbers that would tell it.
_TOLD = {Verdict.FAILED, Verdict.REFUSED, Verdict.ILL_POSED, Verdict.NOT_JUDGED, Verdict.ANOTHER_SCENE}


@dataclass(frozen=True)
class Cell:
    """A judgement with a link to its evidence; ``point``: place of the judgement in a matrix of several points."""

    judgement: Judgement
    href: str
    point: str = ""

    @property
    def title(self) -> str:
        """Tooltip: error with its bar, tolerance, and the limit from the ladder of steps, if there is one."""
        judgement = self.judgement
        text = (
            f"{symbol(judgement.observable)} {judgement.verdict}: error {error(judgement.error)} ± "
            f"{number(judgement.truth_error_bar, 1)} {unit(judgement.unit)}, tolerance {number(judgement.tolerance)}"
        )
        if self.point:
            text += f" at {self.point}"
        if judgement.limit_error_bar is None:
            return text
        text += f"; {judgement.limit}"
        if judgement.limit_error == math.inf:  # it has another number of events
            return text
        off = f"{error(judgement.limit_error)} ± {error(judgement.limit_error_bar, 1)}"
        return f"{text}: off by {off}, order {number(judgement.order)}"


@dataclass(frozen=True)
class MatrixLine:
    """Line of the matrix: a row or a run, with its cells by observable.

    Attributes:
        href: link to its evidence.
        notes: sentences below it: why there is no result or no judgement, proven causes with remedies, remarks.
        before: longest time before its first step [s].
    """

    of: ReportedRow | ReportedRun
    cells: dict[str, Cell]
    verdict_text: str
    href: str
    notes: list[str]
    as_expected: bool
    cost: Cost | None
    before: float | None = None


@dataclass(frozen=True)
class Matrix:
    """Verdict matrix: unit of each column, lines by engine; ``compiles``: a time before the first step exceeds 10 s."""

    columns: dict[str, str]
    groups: dict[str, list[MatrixLine]]
    compiles: bool


def overview(content: ReportedComparison) -> Matrix:
    """Verdict matrix of a comparison: the worst verdict of each row over all points."""
    points = list(dict.fromkeys(run.point for run in content.runs))
    lines, seconds = [], seconds_before(content)
    for index, row in enumerate(content.rows):
        runs = content.runs_of(index)
        worst = next((run for run in runs if run.verdict == row.verdict), runs[0])
        slowest = (run.cost for run in runs if run.cost and run.seconds_per_second == row.seconds_per_second)
        hrefs = {point: content.run_id(index, point) for point in points}
        cells = {name: Cell(item, hrefs[item.point], item.point) for name, item in row.observables.items()}
        notes = _notes(row, row.reason, [told.cause for told in row.diagnosis])
        notes += [f"* {remark}" for remark in row.remarks]
        shown = (verdict_text(row, runs), hrefs[worst.point], notes, row.as_expected, next(slowest, None))
        lines.append(MatrixLine(row, cells, *shown, before=seconds.get(index)))
    return _matrix(content, lines)


def counted(content: ReportedComparison) -> str:
    """Counts of settings by verdict, in one line."""
    verdicts = [row.verdict.value for row in content.rows]
    counts = ", ".join(f"{sign} {verdicts.count(word)} {word}" for word, sign in SYMBOLS.items() if word in verdicts)
    surprise = "nothing is contradicted" if unjudged(content) else "as expected"
    end = f"; {surprise if content.as_expected else 'not as expected'}" if content.claims else ""
    return f"{plural(len(verdicts), 'settings')}: {counts}{end}"


def at_point(content: ReportedComparison, name: str) -> Matrix:
    """Verdict matrix of one point of the parameters."""
    lines = []
    for run in content.runs:
        if run.point == name:
            href = content.run_id(run.row, name)
            cells = {judgement.observable: Cell(judgement, href) for judgement in run.judgements}
            notes = _notes(run, run.reason, run.diagnosis)
            shown = (verdict_word(run, [run]), href, notes, not run.contradictions, run.cost, run.build_seconds)
            lines.append(MatrixLine(run, cells, *shown))
    return _matrix(content, lines)


def _notes(of: ReportedRow | ReportedRun, reason: str, causes: Sequence[Diagnosis]) -> list[str]:
    """Reason where there is no result or no judgement, and the proven causes of a difference with their remedies."""
    reasons = [reason] if reason and of.verdict in _TOLD else []
    return [*reasons, *(f"{item.sentence}: {item.cause.remedy}" for item in causes)]


def _matrix(content: ReportedComparison, lines: list[MatrixLine]) -> Matrix:
    groups: dict[str, list[MatrixLine]] = {}
    for line in lines:
        groups.setdefault(line.of.name, []).append(line)
    return Matrix(observables(content), groups, bool(seconds_before(content)))
