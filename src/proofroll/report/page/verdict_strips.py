"""Verdicts of a comparison in one look: a dot for each setting on an axis of its error over what is allowed."""

import math
from collections import Counter
from dataclasses import dataclass

from proofroll.core.verdict import Verdict
from proofroll.report.comparison.records import ReportedComparison, ReportedRow, WorstJudgement
from proofroll.report.comparison.verdict_matrix import notes

# Decades of the axis: what is less or more stands at its ends.
LOWEST, HIGHEST = -8, 4
# Height of a strip and distance of dots above each other [px]; width of a place in which they hide each other [%].
HEIGHT, RISE, WIDTH = 34, 6.4, 1.6
_UNJUDGED = {Verdict.ILL_POSED, Verdict.NOT_JUDGED, Verdict.ANOTHER_SCENE}


@dataclass(frozen=True)
class Dot:
    """Dot of a setting: engine, place on the axis [%], and height [px]."""

    engine: str
    x: float
    y: float


def place(value: float) -> float:
    """Place of an error over what is allowed on the axis [%], logarithmic."""
    decades = math.log10(value) if 0 < value < math.inf else math.copysign(math.inf, value - 1)
    return round(100 * (min(max(decades, LOWEST), HIGHEST) - LOWEST) / (HIGHEST - LOWEST), 2)


def ranked(row: ReportedRow) -> list[WorstJudgement]:
    """Quantities of a row, that which takes most of its tolerance first; those by which none is judged are last."""
    return sorted(row.observables.values(), key=lambda item: (item.verdict in _UNJUDGED, -item.of_allowed))


def strip(content: ReportedComparison) -> list[Dot]:
    """Dots of the settings that are judged; of several at one place the next stand above and below the first."""
    taken: Counter[int] = Counter()
    dots = []
    for row in content.rows:
        judged = [item for item in ranked(row)[:1] if item.verdict not in _UNJUDGED]
        for x in (place(item.of_allowed) for item in judged):
            taken[round(x / WIDTH)] += 1
            count = taken[round(x / WIDTH)]
            dots.append(Dot(row.name, x, HEIGHT / 2 + (1 if count % 2 else -1) * (count // 2) * RISE))
    return dots


def reason(row: ReportedRow) -> str:
    """Cause why a row does not agree: the words of its file where they are about its verdict, else its notes."""
    return row.claim.short if row.claim.short and row.verdict in row.claim.expect else "; ".join(notes(row))
