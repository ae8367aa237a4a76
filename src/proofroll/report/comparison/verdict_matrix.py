"""Matrix of verdicts: a line for each setting, over all points of the parameters or at one."""

import math

from proofroll.core.number_format import counted as plural
from proofroll.core.number_format import error, number
from proofroll.core.verdict import Judgement, Verdict
from proofroll.report.comparison.records import ReportedComparison, ReportedRow, ReportedRun
from proofroll.report.comparison.summary import row_at
from proofroll.report.labels import SYMBOLS, symbol, unit, unjudged

# Verdicts whose reason stands in the row: there are no numbers that would tell it.
_TOLD = {Verdict.FAILED, Verdict.REFUSED, Verdict.ILL_POSED, Verdict.NOT_JUDGED, Verdict.ANOTHER_SCENE}


def rows_by_engine(
    content: ReportedComparison, point: str | None = None
) -> dict[str, list[tuple[ReportedRow, list[ReportedRun]]]]:
    """Rows with their runs, by engine; ``point``: as they are there, None: the worst of all points."""
    groups: dict[str, list[tuple[ReportedRow, list[ReportedRun]]]] = {}
    for index, row in enumerate(content.rows):
        runs = [run for run in content.runs_of(index) if point in {None, run.point}]
        if runs:
            groups.setdefault(row.name, []).append((row if point is None else row_at(row, runs), runs))
    return groups


def title(judgement: Judgement, point: str) -> str:
    """Tooltip: error with its bar, tolerance, ``point`` if any, and the limit from the ladder of steps if any."""
    text = (
        f"{symbol(judgement.observable)} {judgement.verdict}: error {error(judgement.error)} ± "
        f"{number(judgement.truth_error_bar, 1)} {unit(judgement.unit)}, tolerance {number(judgement.tolerance)}"
    )
    if point:
        text += f" at {point}"
    if judgement.limit_error_bar is None:
        return text
    text += f"; {judgement.limit}"
    if judgement.limit_error == math.inf:  # it has another number of events
        return text
    off = f"{error(judgement.limit_error)} ± {error(judgement.limit_error_bar, 1)}"
    return f"{text}: off by {off}, order {number(judgement.order)}"


def notes(row: ReportedRow) -> list[str]:
    """Sentences below a row: why there is no result or no judgement, proven causes with remedies, remarks."""
    reasons = [row.reason] if row.reason and row.verdict in _TOLD else []
    causes = [f"{told.sentence}: {told.cause.remedy}" for told in row.diagnosis]
    return [*reasons, *causes, *(f"* {remark}" for remark in row.remarks)]


def worst_point(row: ReportedRow, runs: list[ReportedRun]) -> str:
    """Point at which a row has its verdict."""
    return next((run for run in runs if run.verdict == row.verdict), runs[0]).point


def counted(content: ReportedComparison) -> str:
    """Counts of settings by verdict, in one line."""
    verdicts = [row.verdict.value for row in content.rows]
    counts = ", ".join(f"{sign} {verdicts.count(word)} {word}" for word, sign in SYMBOLS.items() if word in verdicts)
    surprise = "nothing is contradicted" if unjudged(content) else "as expected"
    end = f"; {surprise if content.as_expected else 'not as expected'}" if content.claims else ""
    return f"{plural(len(verdicts), 'settings')}: {counts}{end}"
