"""Slips in the report: events in the truth and in every run, and the conditioning of the first slip."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from proofroll.core.events import Event, EventKind, events_of
from proofroll.core.number_format import number
from proofroll.files.json_data import OPTIONAL
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.slip.onset import onset_verdict as judged_onset
from proofroll.papers.blajer_2006.truth.onset import Onset
from proofroll.report.comparison.plots import Bound, Mark, PointCurves
from proofroll.studies.comparison.planning import point_name

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from proofroll.core.scene import Scene
    from proofroll.report.comparison.records import ReportedComparison, ReportedRun
    from proofroll.report.page.records import ReportedTruth
    from proofroll.studies.comparison.outcome import Run

# Curve on which first slips are marked.
CURVE = "needed_friction"


@dataclass(frozen=True)
class TrueSlips:
    """Slips of the truth: coefficients of friction, the first slip with its conditioning, and all events."""

    mu_static: float | None
    mu_kinetic: float | None
    onset: Onset
    events: list[Event]


@dataclass(frozen=True)
class RunSlips:
    """Events of a run; with bounded friction also the verdict on its first slip."""

    events: list[Event]
    onset_verdict: str | None = field(default=None, metadata=OPTIONAL)


def truth_facts(scene: Scene, dataset: xr.Dataset) -> TrueSlips | None:
    """Slips of the truth; None with unbounded friction."""
    if "onset" not in dataset.attrs:
        return None
    contact = rolling_ball(scene).contact
    onset = Onset(**json.loads(dataset.attrs["onset"]))
    return TrueSlips(contact.mu_static, contact.mu_kinetic, onset, events_of(dataset))


def run_facts(truths: Sequence[ReportedTruth], runs: Sequence[Run]) -> list[RunSlips]:
    """Slips of each run of a comparison.

    Args:
        truths: truths of the comparison, with their :func:`truth_facts`.
        runs: runs of the comparison.
    """
    onsets = {truth.point: truth.own.onset for truth in truths if truth.own is not None}
    return [_run_facts(onsets.get(point_name(run.parameters)), run) for run in runs]


def _run_facts(truth: Onset | None, run: Run) -> RunSlips:
    if truth is None:
        return RunSlips([])
    events = [] if run.trajectory is None else events_of(run.trajectory.dataset)
    slip = next((event for event in events if event.kind == EventKind.SLIP), None)
    return RunSlips(events, judged_onset(truth, run.result, slip))


def ill_posed(truths: Sequence[ReportedTruth]) -> list[str]:
    """Sentence on first slips that are sensitive below parameter precision; empty if there are none."""
    onsets = [(truth.point, truth.own.onset) for truth in truths if truth.own is not None]
    undecided = [(point, onset) for point, onset in onsets if onset.verdict == "ill-posed"]
    if not undecided:
        return []
    percent = f"{100 * undecided[0][1].uncertainty:.3g} %"
    places = "; ".join(point for point, _ in undecided)
    return [
        f"In {len(undecided)} of {len(onsets)} cases the first slip is ill-posed ({places}): a change of the friction "
        f"or the rolling resistance by {percent} makes it, removes it or moves it to another rise of the needed "
        "friction. No setting is judged there."
    ]


def mark(content: ReportedComparison, curves: Sequence[PointCurves]) -> list[PointCurves]:
    """Curves of a comparison; on that of needed friction, bounds of friction and first slips are marked."""
    truths = content.evidence.truths if content.evidence else []
    slips = {truth.point: truth.own for truth in truths if truth.own is not None}
    return [_marked(content, entry, slips[entry.point]) if entry.point in slips else entry for entry in curves]


def _marked(content: ReportedComparison, curves: PointCurves, truth: TrueSlips) -> PointCurves:
    runs = [(-1, truth), *((run.row, run.own) for run in content.runs if run.point == curves.point)]
    firsts = [(row, first_slip(slips.events)) for row, slips in runs]
    marks = [Mark(row, slip.time, "first slip") for row, slip in firsts if slip is not None]
    named = {"static": truth.mu_static, "kinetic": truth.mu_kinetic if truth.mu_kinetic != truth.mu_static else None}
    bounds = [Bound(f"μ {name}", value) for name, value in named.items() if value is not None]
    observables = [
        replace(item, marks=marks, bounds=bounds) if item.name == CURVE else item for item in curves.observables
    ]
    return replace(curves, observables=observables)


def first_slip(events: Sequence[Event]) -> Event | None:
    """First slip with a finite time, or None."""
    return next((event for event in events if event.kind == EventKind.SLIP and math.isfinite(event.time)), None)


# Largest number of events in the table; the page counts the rest.
SHOWN = 4
# Verdict on a first slip -> verdict whose colour and sign the page uses.
PAINTED = {"agree": "agrees", "disagree": "differs", "ill-posed": "ill-posed", "refused": "refused", "failed": "failed"}


@dataclass(frozen=True)
class EventCell:
    """An event beside the truth's event of the same number: ``difference`` [s]; ``wrong``: why they do not match."""

    event: Event | None
    difference: str
    wrong: str


@dataclass(frozen=True)
class SlipLine:
    """Line of a table: slips of the truth or of a ``run``; ``count``: of all its events; a failed run has no cells."""

    run: ReportedRun | None
    first: Event | None
    difference: str
    cells: list[EventCell]
    count: int
    in_order: bool


@dataclass(frozen=True)
class SlipTable:
    """Table of slips: the truth, then a line for each run.

    ``wrong``: the verdict on a run whose events differ in kind or number from the truth's.
    """

    columns: int
    wrong: str
    truth: SlipLine
    lines: list[SlipLine]


def conditioning(truth: TrueSlips, until: float) -> list[tuple[str, str]]:
    """Names and texts on the truth's first slip and its sensitivity to the parameters."""
    onset = truth.onset
    percent = f"{100 * onset.uncertainty:.3g} %"
    facts = []
    if onset.time is None:
        facts.append(("First slip", f"none until {until:g} s"))
    else:
        early, late = (_time(value) for value in (onset.earliest, onset.latest))
        text = _time(onset.time, 9)
        if not onset.time == onset.earliest == onset.latest:
            text += f"; {early} with μ smaller and f larger by {percent}, {late} the other way round"
        facts.append(("First slip", text))
    if onset.time:
        facts.append(("d ln t / d ln μ", number(onset.by_mu, 4)))
        facts.append(("d ln t / d ln f", number(onset.by_f, 4)))
    edges = [(onset.edge_below, "below"), (onset.edge_above, "above")]
    edge_texts = [f"μ = {value:.6g} {side}" for value, side in edges if value is not None]
    if edge_texts and math.isfinite(onset.distance):
        edge_texts.append(f"the nearest {number(100 * onset.distance, 3)} % from μ = {truth.mu_static:.6g}")
    facts.append(("Stair edges", ", ".join(edge_texts) or f"none until {until:g} s"))
    return facts


def slip_table(content: ReportedComparison, point: str, truth: TrueSlips) -> SlipTable:
    """Table of first slips and first events at the point ``point``."""
    runs = [run for run in content.runs if run.point == point]
    columns = min(SHOWN, max(len(slips.events) for slips in (truth, *(run.own for run in runs))))

    def line(run: ReportedRun | None, events: Sequence[Event]) -> SlipLine:
        slip, true = first_slip(events), first_slip(truth.events)
        shown = range(columns) if run is None or run.status == "done" else ()
        return SlipLine(
            run=run,
            first=slip,
            difference=signed(slip.time - true.time) if run and slip and true else "–",
            cells=[_cell(events, truth.events, index, is_own=run is None) for index in shown],
            count=len(events),
            in_order=[event.kind for event in events] == [event.kind for event in truth.events],
        )

    wrong = "ill-posed" if truth.onset.verdict == "ill-posed" else "differs"
    return SlipTable(columns, wrong, line(None, truth.events), [line(run, run.own.events) for run in runs])


def clock(event: Event) -> str:
    """Time of an event [s] as text, with the digits that its bracket justifies."""
    return _to_digits(event.time, event, most=9)


def between(event: Event) -> str:
    """Bracket of an event [s] as text, with the digits of its width."""
    return " … ".join(_to_digits(time, event, most=12) for time in (event.time_low, event.time_high))


def bracket(event: Event) -> str:
    """Bracket of an event around its time [s]: ``±5e-4``, or ``-1e-3 +2e-9`` if the sides differ."""
    low, high = event.time - event.time_low, event.time_high - event.time
    if not (math.isfinite(low) and math.isfinite(high)):
        return "no bracket"
    if abs(high - low) <= 0.1 * max(abs(high), abs(low)):
        return f"±{number(max(high, low), 1)}"
    return f"-{number(low, 1)} +{number(high, 1)}"


def signed(value: float) -> str:
    """Text of a difference with its sign."""
    return f"+{number(value)}" if value > 0 else number(value)


def _cell(events: Sequence[Event], true: Sequence[Event], index: int, is_own: bool = False) -> EventCell:
    """Cell that compares an event with the truth's event of the same number."""
    event = events[index] if index < len(events) else None
    twin = true[index] if index < len(true) else None
    like = event is not None and twin is not None and event.kind == twin.kind
    wrong = "" if like or event is twin else "missing" if event is None else "not in the truth"
    apart = event.time - twin.time if event and twin and not (is_own or wrong) else math.nan
    return EventCell(event, signed(apart) if math.isfinite(apart) else "", wrong)


def _time(value: float | None, digits: int = 6) -> str:
    return "none" if value is None else f"{value:.{digits}g} s" if value else "from the start"


def _to_digits(value: float, event: Event, most: int) -> str:
    """Text of a time [s] with one digit more than the width of the event's bracket."""
    if not math.isfinite(value):
        return "–"
    width = event.time_high - event.time_low
    if not (math.isfinite(width) and width > 0):
        return f"{value:.9g}"
    # A width of 0.001 may be stored as a little less.
    return f"{value:.{min(most, max(3, 1 - math.floor(math.log10(width) + 1e-3)))}f}"
