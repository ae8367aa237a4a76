"""Errors and costs of a comparison's rows over all cases, for rankings."""

import math
from collections.abc import Sequence
from dataclasses import replace

from proofroll.core.verdict import Judgement
from proofroll.report.comparison.records import ReportedComparison, ReportedRun
from proofroll.report.page.candidates import Candidate
from proofroll.report.page.choice_matrix import ChoiceMatrix


def scores(content: ReportedComparison, choice: ChoiceMatrix) -> list[Candidate]:
    """Candidates for each row at its own step; errors are None unless known and finite at every point."""
    candidates: dict[int, Candidate] = {}
    for row in choice.rows:
        for item in row.found.get(content.name, ()):
            candidates.setdefault(item.row, item)  # the first candidate of a row has its own step
    points = {run.point for run in content.runs}
    rows = []
    for number, (name, _, runs) in enumerate(content.lines()):
        if number in candidates:
            item = candidates[number]
            whole = item.blame is None and {run.point for run in runs} == points
            sizes = (item.motion, item.forces, item.motion_held, item.forces_held)
            motion, forces, *held = (x if whole and x is not None and math.isfinite(x) else None for x in sizes)
            candidate = replace(item, motion=motion, forces=forces, motion_held=held[0], forces_held=held[1])
            rows.append(replace(candidate, name=name))
    return rows


def closest(content: ReportedComparison, choice: ChoiceMatrix) -> Candidate | None:
    """Row closest to the truth in motion and forces without luck, rows with the truth's own equations left out."""
    sizes = [
        (item.tolerance(forces=True), item) for item in scores(content, choice) if not content.rows[item.row].shared
    ]
    return min(((size, item) for size, item in sizes if size is not None), key=lambda pair: pair[0], default=(0, None))[
        1
    ]


def furthest_off(content: ReportedComparison, runs: Sequence[ReportedRun]) -> Judgement | None:
    """Judgement of the coordinate with the largest finite relative error, ill-posed ones left out."""
    motion = content.headlines("motion")
    judged = (judgement for run in runs for judgement in run.judgements if judgement.observable in motion)
    finite = [item for item in judged if item.verdict != "ill-posed" and math.isfinite(item.error)]
    return max(finite, key=lambda item: item.error / item.scale, default=None)
