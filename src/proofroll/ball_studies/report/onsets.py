"""Bounded friction in the report: what happened when, in the truth and in every run, and how well that is posed."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from proofroll.ball_studies.onset import onset_verdict as judged_onset
from proofroll.core.events import Event, events_of
from proofroll.core.number_format import number
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.files.json_data import OPTIONAL
from proofroll.report.comparison.plots import Bound, Mark, PointCurves
from proofroll.studies.comparison.planning import point_name
from proofroll.truth.ball_on_surface.onset import Onset

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from proofroll.core.scene import Scene
    from proofroll.report.comparison.records import ReportedComparison, ReportedRun
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


# Events that the table shows; the page says how many more there are.
SHOWN = 4
# How the page paints a verdict on the onset, and the sign that goes with it: as the verdict of the same meaning.
PAINTED = {"agree": "agrees", "disagree": "differs", "ill-posed": "ill-posed", "refused": "refused", "failed": "failed"}


@dataclass(frozen=True)
class EventCell:
    """One event beside the truth's of the same number: its ``difference`` [s], and what is ``wrong`` with it."""

    event: Event | None
    difference: str
    wrong: str


@dataclass(frozen=True)
class SlipLine:
    """Slips of the truth or of a ``run``, with the ``count`` of all its events; no cells where it failed."""

    run: ReportedRun | None
    first: Event | None
    difference: str
    cells: list[EventCell]
    count: int
    in_order: bool


@dataclass(frozen=True)
class SlipTable:
    """The truth on top, then one line for each run; ``wrong``: what a wrong event is called here."""

    columns: int
    wrong: str
    truth: SlipLine
    lines: list[SlipLine]


def conditioning(truth: TrueSlips, until: float) -> list[tuple[str, str]]:
    """The truth's onset and how it hangs on the parameters, as names and texts."""
    onset = truth.onset
    known = f"{100 * onset.uncertainty:.3g} %"
    facts = []
    if onset.time is None:
        facts.append(("First slip", f"none until {until:g} s"))
    else:
        early, late = (_time(value) for value in (onset.earliest, onset.latest))
        text = _time(onset.time, 9)
        if not onset.time == onset.earliest == onset.latest:
            text += f"; {early} with μ smaller and f larger by {known}, {late} the other way round"
        facts.append(("First slip", text))
    if onset.time:
        facts.append(("d ln t / d ln μ", number(onset.by_mu, 4)))
        facts.append(("d ln t / d ln f", number(onset.by_f, 4)))
    edges = [(onset.edge_below, "below"), (onset.edge_above, "above")]
    said = [f"μ = {value:.6g} {side}" for value, side in edges if value is not None]
    if said and math.isfinite(onset.distance):
        said.append(f"the nearest {number(100 * onset.distance, 3)} % from μ = {truth.mu_static:.6g}")
    facts.append(("Stair edges", ", ".join(said) or f"none until {until:g} s"))
    return facts


def slip_table(content: ReportedComparison, at: str, truth: TrueSlips) -> SlipTable:
    """First slips and the first events at one point, which is named ``at``."""
    runs = [run for run in content.runs if run.point == at]
    columns = min(SHOWN, max(len(slips.events) for slips in (truth, *(run.own for run in runs))))

    def line(run: ReportedRun | None, events: Sequence[Event]) -> SlipLine:
        first, true = first_slip(events), first_slip(truth.events)
        shown = range(columns) if run is None or run.status == "done" else ()
        return SlipLine(
            run,
            first,
            signed(first.time - true.time) if run and first and true else "–",
            [_cell(events, truth.events, index, own=run is None) for index in shown],
            len(events),
            [event.kind for event in events] == [event.kind for event in truth.events],
        )

    wrong = "ill-posed" if truth.onset.verdict == "ill-posed" else "differs"
    return SlipTable(columns, wrong, line(None, truth.events), [line(run, run.own.events) for run in runs])


def clock(event: Event) -> str:
    """The time of an event [s], to the digits that its bracket leaves."""
    return _to_digits(event.time, event, most=9)


def between(event: Event) -> str:
    """The bracket of an event [s], to the digits of its width."""
    return " … ".join(_to_digits(time, event, most=12) for time in (event.time_low, event.time_high))


def bracket(event: Event) -> str:
    """Bracket of an event around its time [s]: ``±5e-4``, or ``-1e-3 +2e-9`` where the sides are unlike."""
    low, high = event.time - event.time_low, event.time_high - event.time
    if not (math.isfinite(low) and math.isfinite(high)):
        return "no bracket"
    if abs(high - low) <= 0.1 * max(abs(high), abs(low)):
        return f"±{number(max(high, low), 1)}"
    return f"-{number(low, 1)} +{number(high, 1)}"


def signed(value: float) -> str:
    """A difference with its sign."""
    return f"+{number(value)}" if value > 0 else number(value)


def _cell(events: Sequence[Event], true: Sequence[Event], index: int, own: bool = False) -> EventCell:
    """One event beside the truth's event with the same number."""
    event = events[index] if index < len(events) else None
    twin = true[index] if index < len(true) else None
    like = event is not None and twin is not None and event.kind == twin.kind
    wrong = "" if like or event is twin else "missing" if event is None else "not in the truth"
    apart = event.time - twin.time if event and twin and not (own or wrong) else math.nan
    return EventCell(event, signed(apart) if math.isfinite(apart) else "", wrong)


def _time(value: float | None, digits: int = 6) -> str:
    return "none" if value is None else f"{value:.{digits}g} s" if value else "from the start"


def _to_digits(value: float, event: Event, most: int) -> str:
    """A time [s] with one digit more than the width of the event's bracket has."""
    if not math.isfinite(value):
        return "–"
    width = event.time_high - event.time_low
    if not (math.isfinite(width) and width > 0):
        return f"{value:.9g}"
    # A width of 0.001 may be stored as a little less.
    return f"{value:.{min(most, max(3, 1 - math.floor(math.log10(width) + 1e-3)))}f}"
