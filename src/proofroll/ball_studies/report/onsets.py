"""Bounded friction in the report: what happened when, in the truth and in every run, and how well that is posed."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from proofroll.ball_studies.onset import onset_verdict as judged_onset
from proofroll.core.events import Event, events_of
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.files.json_data import OPTIONAL
from proofroll.report.comparison.plots import Bound, Mark, PointCurves
from proofroll.studies.comparison.planning import point_name
from proofroll.truth.ball_on_surface.onset import Onset

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from proofroll.core.scene import Scene
    from proofroll.report.comparison.records import ReportedComparison
    from proofroll.report.page.records import ReportedTruth
    from proofroll.studies.comparison.outcome import Run

# The curve on which onsets are marked.
CURVE = "needed_friction"


@dataclass(frozen=True)
class TrueSlips:
    """Slips of the truth in the report: the bounds of friction, the first slip and all events."""

    mu_static: float | None
    mu_kinetic: float | None
    onset: Onset
    events: list[Event]


@dataclass(frozen=True)
class RunSlips:
    """The events of a run, and where friction is bounded what its first slip is to the truth's."""

    events: list[Event]
    onset_verdict: str | None = field(default=None, metadata=OPTIONAL)


def truth_facts(scene: Scene, dataset: xr.Dataset) -> TrueSlips | None:
    """The truth's slips; None where friction has no bound."""
    if "onset" not in dataset.attrs:
        return None
    contact = rolling_ball(scene).contact
    onset = Onset(**json.loads(dataset.attrs["onset"]))
    return TrueSlips(contact.mu_static, contact.mu_kinetic, onset, events_of(dataset))


def run_facts(truths: Sequence[ReportedTruth], runs: Sequence[Run]) -> list[RunSlips]:
    """The slips of each run.

    Args:
        truths: of a comparison, with their :func:`truth_facts`.
        runs: of the comparison.
    """
    known = {truth.point: truth.own.onset for truth in truths if truth.own is not None}
    return [_run_facts(known.get(point_name(run.parameters)), run) for run in runs]


def _run_facts(truth: Onset | None, run: Run) -> RunSlips:
    if truth is None:
        return RunSlips([])
    events = [] if run.trajectory is None else events_of(run.trajectory.dataset)
    first = next((event for event in events if event.kind == "slip"), None)
    return RunSlips(events, judged_onset(truth, run.result, first))


def ill_posed(truths: Sequence[ReportedTruth]) -> list[str]:
    """Sentence on first slips that are sensitive below parameter precision; empty if there are none."""
    onsets = [(truth.point, truth.own.onset) for truth in truths if truth.own is not None]
    undecided = [(point, onset) for point, onset in onsets if onset.verdict == "ill-posed"]
    if not undecided:
        return []
    known = f"{100 * undecided[0][1].uncertainty:.3g} %"
    where = "; ".join(point for point, _ in undecided)
    return [
        f"In {len(undecided)} of {len(onsets)} cases the first slip is ill-posed ({where}): a change of the friction "
        f"or the rolling resistance by {known} makes it, removes it or moves it to another rise of the needed "
        "friction. No setting is judged there."
    ]


def mark(content: ReportedComparison, curves: Sequence[PointCurves]) -> list[PointCurves]:
    """The curves of a comparison with the bounds of friction and every first slip on that of needed friction."""
    truths = content.evidence.truths if content.evidence else []
    slips = {truth.point: truth.own for truth in truths if truth.own is not None}
    return [_marked(content, entry, slips[entry.point]) if entry.point in slips else entry for entry in curves]


def _marked(content: ReportedComparison, curves: PointCurves, truth: TrueSlips) -> PointCurves:
    runs = [(-1, truth), *((run.row, run.own) for run in content.runs if run.point == curves.point)]
    firsts = [(row, first_slip(slips.events)) for row, slips in runs]
    marks = [Mark(row, first.time, "first slip") for row, first in firsts if first is not None]
    named = {"static": truth.mu_static, "kinetic": truth.mu_kinetic if truth.mu_kinetic != truth.mu_static else None}
    bounds = [Bound(f"μ {name}", value) for name, value in named.items() if value is not None]
    observables = [
        replace(item, marks=marks, bounds=bounds) if item.name == CURVE else item for item in curves.observables
    ]
    return replace(curves, observables=observables)


def first_slip(events: Sequence[Event]) -> Event | None:
    """The first slip that has a time."""
    return next((event for event in events if event.kind == "slip" and math.isfinite(event.time)), None)
