"""Distance of a comparison's rows from the truth, over all cases."""

import math
from collections.abc import Sequence
from dataclasses import replace

from proofroll.core.verdict import Judgement
from proofroll.report.comparison.records import ReportedComparison, ReportedRun
from proofroll.report.page.candidates import Candidate
from proofroll.report.page.choice_matrix import ChoiceMatrix


def scores(content: ReportedComparison, choice: ChoiceMatrix) -> list[Candidate]:
    """Each row with its own step; without an error that is not known and finite at every point."""
    candidates: dict[int, Candidate] = {}
    for row in choice.rows:
        for item in row.found.get(content.name, ()):
            candidates.setdefault(item.row, item)  # of its steps its own comes first
    points = {run.point for run in content.runs}
    rows = []
    for number, (name, _, runs) in enumerate(content.lines()):
        if number in candidates:
            item = candidates[number]
            whole = item.blame is None and {run.point for run in runs} == points
            motion, forces = (
                size if whole and size is not None and math.isfinite(size) else None
                for size in (item.motion, item.forces)
            )
            rows.append(replace(item, name=name, motion=motion, forces=forces))
    return rows


def closest(content: ReportedComparison, choice: ChoiceMatrix) -> Candidate | None:
    """The row nearest to the truth in motion and forces; without those that rest on the truth's own equations."""
    known = [(item.error(forces=True), item) for item in scores(content, choice) if not content.rows[item.row].shared]
    return min(((size, item) for size, item in known if size is not None), key=lambda pair: pair[0], default=(0, None))[
        1
    ]


def furthest_off(content: ReportedComparison, runs: Sequence[ReportedRun]) -> Judgement | None:
    """Judgement of the coordinate with the largest finite relative error, ill-posed ones left out."""
    motion = content.headlines("motion")
    judged = (judgement for run in runs for judgement in run.judgements if judgement.observable in motion)
    finite = [item for item in judged if item.verdict != "ill-posed" and math.isfinite(item.error)]
    return max(finite, key=lambda item: item.error / item.scale, default=None)
