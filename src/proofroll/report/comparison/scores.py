"""Distance of a comparison's rows from the truth, over all cases."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from proofroll.core.verdict import Judgement
from proofroll.report.comparison.records import ReportedComparison, ReportedRun


@dataclass(frozen=True)
class Score:
    """A row over all points of the parameters.

    Attributes:
        index: of the row.
        name: of the row.
        motion: largest error of any coordinate with the truth's error bar, over its range; None if a run is missing or
            not finite.
        forces: largest error of any reaction, over the largest normal force; None likewise.
        seconds: wall seconds per simulated second, the slowest case; None if not measured.
    """

    index: int
    name: str
    motion: float | None
    forces: float | None
    seconds: float | None

    @property
    def worst(self) -> float | None:
        """The larger of both errors."""
        return None if self.motion is None or self.forces is None else max(self.motion, self.forces)


def scores(content: ReportedComparison) -> list[Score]:
    """One score per row of the comparison."""
    judged = {name for row in content.rows for name in row.observables}
    coordinates, forces_of = (
        [name for name in content.headlines(role) if name in judged] for role in ("motion", "reaction")
    )
    points = {run.point for run in content.runs}
    found = []
    for index, (name, row, runs) in enumerate(content.lines()):
        everywhere = {run.point for run in runs} == points
        motion, forces = (_relative(runs, group) if everywhere else None for group in (coordinates, forces_of))
        found.append(Score(index, name, motion, forces, row.seconds_per_second))
    return found


def closest(content: ReportedComparison) -> Score | None:
    """The row nearest to the truth in motion and forces; without those that rest on the truth's own equations."""
    found = [score for score in scores(content) if score.worst is not None and not content.rows[score.index].shared]
    return min(found, key=lambda score: score.worst or 0.0, default=None)


def furthest_off(content: ReportedComparison, runs: Sequence[ReportedRun]) -> Judgement | None:
    """The largest error of a coordinate in parts of its scale, where it can be judged and is finite."""
    motion = content.headlines("motion")
    judged = (judgement for run in runs for judgement in run.judgements if judgement.observable in motion)
    finite = [item for item in judged if item.verdict != "ill-posed" and math.isfinite(item.error)]
    return max(finite, key=lambda item: item.error / item.scale, default=None)


def _relative(runs: list[ReportedRun], group: Sequence[str]) -> float | None:
    """Largest error with the truth's error bar, over its scale; None where something is missing.

    What cannot be judged, because the question is ill-posed, is left out.
    """
    sizes: list[float] = []
    for run in runs:
        chosen = [judgement for judgement in run.judgements if judgement.observable in group]
        if run.status != "done" or not chosen:
            return None
        chosen = [judgement for judgement in chosen if judgement.verdict != "ill-posed"]
        if any(not math.isfinite(judgement.error) for judgement in chosen):
            return None
        # What the truth does not know it cannot vouch for.
        sizes += [(judgement.error + judgement.truth_error_bar) / judgement.scale for judgement in chosen]
    return max(sizes, default=None)
