"""Errors of a comparison's rows over all cases, for rankings."""

import math
from collections.abc import Sequence

from proofroll.core.verdict import Judgement
from proofroll.report.comparison.records import ReportedComparison, ReportedRun


def furthest_off(content: ReportedComparison, runs: Sequence[ReportedRun]) -> Judgement | None:
    """Judgement of the coordinate with the largest finite relative error, ill-posed ones left out."""
    motion = content.headlines("motion")
    judged = (judgement for run in runs for judgement in run.judgements if judgement.observable in motion)
    finite = [item for item in judged if item.verdict != "ill-posed" and math.isfinite(item.error)]
    return max(finite, key=lambda item: item.error / item.scale, default=None)
