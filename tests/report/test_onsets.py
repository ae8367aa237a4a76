"""Bounded friction in the report: events, the first slip with its conditioning, and points that nobody is judged by."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folded import whole

from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.events import Event, events_of, with_events
from proofroll.core.truth import truth
from proofroll.core.verdict import Judgement, Verdict
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene, read_scene_file
from proofroll.files.trajectory_file import write
from proofroll.papers.blajer_2006.report.onsets import CURVE, bracket, clock, conditioning, mark, slip_table
from proofroll.papers.blajer_2006.truth.onset import Onset
from proofroll.report.comparison.plots import Bound, point_curves
from proofroll.report.comparison.records import ReportedRun
from proofroll.report.labels import MEANINGS, SYMBOLS
from proofroll.report.page.growing import begun
from proofroll.report.page.html import page
from proofroll.report.page.records import ReportContent, ReportedTruth, report_content
from proofroll.report.terminal.screen import console
from proofroll.report.terminal.verdicts import verdict_parts
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import ComparedPoint, Outcome, Run
from proofroll.studies.comparison.planning import point_name

UNTIL, EVERY = 2.1, 0.05
WELL = {"speed": 4.0, "rolling_resistance": 5e-4, "mu_static": 0.35}
EDGE = {"speed": 4.0, "rolling_resistance": 5e-4, "mu_static": 0.391459}
FREE = {"speed": 4.0}
COMMAND = "proofroll report slipping"


def judgement(name: str, error: float, verdict: Verdict) -> Judgement:
    """One invented judgement."""
    return Judgement(name, "m", error, 1e-12, 1e-3, 1.0, verdict)


@pytest.fixture(scope="module")
def slipping(tmp_path_factory: pytest.TempPathFactory) -> tuple[Outcome, Store]:
    """Rows that slip as the truth does, too often and never, and one that is refused; one point has no bound."""
    store = Store(tmp_path_factory.mktemp("slipping") / "cases")
    rows = [Row("alpha", "band"), Row("beta", "band"), Row("gamma", "band"), Row("delta", "band")]
    bounds = dict.fromkeys(("z", "N", "event_order"), Tolerance(1e-3, True))
    band = {"band": Band("a reason", bounds)}
    comparison = Comparison("slipping", "Slipping", "Who slips?", "sphere_in_cylinder", UNTIL, EVERY, bands=band)
    comparison = dataclasses.replace(comparison, rows=rows, points=[WELL, EDGE, FREE])
    times = np.linspace(0.0, UNTIL, round(UNTIL / EVERY) + 1)
    runs, points = [], {}
    for point in (WELL, EDGE, FREE):
        scene = load_scene("sphere_in_cylinder", **point)
        dataset = truth(scene, times)
        true = events_of(dataset)
        slips = [Event(e.kind, e.time + 1e-7, e.time - 1e-6, e.time + 1e-6) for e in true]
        often = [
            Event(k, t, t - 5e-3, t + 5e-3) for k, t in zip(["slip", "stick"] * 3, np.arange(1, 7) / 4, strict=True)
        ]
        verdict = Verdict.ILL_POSED if point is EDGE else Verdict.DIFFERS
        for row, events in zip(rows, (slips, often if true else [], [], None), strict=True):
            case = Case("sphere_in_cylinder", point, scene.digest, EngineFacts(row.engine, "1", "c", {}), UNTIL, EVERY)
            if events is None:
                result = Result(Status.REFUSED, "needs <b>more</b>")
                runs.append(Run(row, point, case.engine, result, [], [], case))
                continue
            write(with_events(dataset.drop_dims("event"), events) if true else dataset, store.trajectory(case))
            worse = verdict if row.engine != "alpha" and true else Verdict.AGREES
            judged = [
                judgement("z", math.inf if worse is Verdict.ILL_POSED else 1e-6, worse),
                judgement("N", 0.0, worse),
            ]
            if true:
                judged.append(judgement("event_order", float(worse is not Verdict.AGREES), worse))
            result = Result(Status.DONE, "done", seconds_per_second=1.0, trajectory=store.trajectory(case).name)
            runs.append(Run(row, point, case.engine, result, judged, [], case, trajectory=store.stored(case)))
        known = Case("sphere_in_cylinder", point, "d", EngineFacts("truth", "1", "c", {}), UNTIL, EVERY)
        points[point_name(point)] = ComparedPoint(scene, known, Result(Status.DONE, "done"), store.stored(known))
        write(dataset, store.trajectory(known))
    order = {id(row): index for index, row in enumerate(rows)}
    usual, file = load_scene("sphere_in_cylinder"), read_scene_file("sphere_in_cylinder")
    return Outcome(comparison, usual, file, sorted(runs, key=lambda run: order[id(run.row)]), points), store


@pytest.fixture(scope="module")
def content(slipping: tuple[Outcome, Store]) -> ReportContent:
    """The report's content."""
    return report_content([slipping[0]], COMMAND)


def shown(content: ReportContent, slipping: tuple[Outcome, Store]) -> str:
    """The page."""
    return page(content, [point_curves(slipping[0])])


def runs_at(content: ReportContent, point: dict[str, float]) -> dict[str, ReportedRun]:
    """The runs at a point by engine."""
    return {run.engine: run for run in content.comparisons[0].runs if run.point == point_name(point)}


def truth_at(content: ReportContent, point: dict[str, float]) -> ReportedTruth:
    """The truth's entry of a point."""
    evidence = content.comparisons[0].evidence
    assert evidence
    return next(entry for entry in evidence.truths if entry.point == point_name(point))


@pytest.mark.drill
def test_data_holds_events_onsets_and_their_verdicts(content: ReportContent) -> None:
    """Each run its events with brackets, each truth its conditioning; where friction has no bound, neither."""
    runs = runs_at(content, WELL)
    assert [event.kind for event in runs["alpha"].own.events] == ["slip", "stick"]
    assert set(plain(runs["alpha"])["events"][0]) == {"kind", "time", "time_low", "time_high", "name"}
    assert runs["gamma"].own.events == runs["delta"].own.events == []
    verdicts = {name: run.own.onset_verdict for name, run in runs.items()}
    assert verdicts == {"alpha": "agree", "beta": "disagree", "gamma": "disagree", "delta": "refused"}
    entry = truth_at(content, WELL)
    assert entry.own.onset.time == pytest.approx(1.7201831716, abs=1e-8)
    assert entry.own.onset.verdict == "well-posed"
    assert (entry.own.mu_static, len(entry.own.events)) == (0.35, 2)
    assert "onset" not in plain(truth_at(content, FREE))
    assert "onset_verdict" not in plain(runs_at(content, FREE)["alpha"])
    assert {run.own.onset_verdict for run in runs_at(content, EDGE).values()} == {"ill-posed", "refused"}


@pytest.mark.drill
def test_table_says_what_is_missing_added_and_left_out(content: ReportContent) -> None:
    """Events stand beside the truth's of the same number; more than the table holds are counted."""
    well, edge = truth_at(content, WELL), truth_at(content, EDGE)
    table = slip_table(content.comparisons[0], well.point, well.own)
    alpha, beta, gamma, delta = table.lines
    assert alpha.in_order
    assert alpha.difference == alpha.cells[0].difference == "+1e-7"
    assert [cell.wrong for cell in beta.cells] == ["", "", "not in the truth", "not in the truth"]
    assert (beta.count, table.columns, beta.in_order) == (6, 4, False)
    assert [cell.wrong for cell in gamma.cells] == ["missing", "missing", "", ""]
    assert (gamma.first, gamma.difference) == (None, "–")
    assert delta.run
    assert (delta.run.status, delta.run.message, delta.cells) == ("refused", "needs <b>more</b>", [])
    assert table.wrong == "differs"
    assert slip_table(content.comparisons[0], edge.point, edge.own).wrong == "ill-posed"


def test_conditioning_names_the_edges(content: ReportContent) -> None:
    """Time, sensitivities, edges and the distance to the nearer of them; and what there is to say without a slip."""
    facts = dict(conditioning(truth_at(content, WELL).own, UNTIL))
    assert facts["First slip"].startswith("1.72018317 s; 1.71963 s with μ smaller")
    assert facts["d ln t / d ln μ"] == "0.3227"
    assert "μ = 0.391459 above, the nearest 11.8 % from μ = 0.35" in facts["Stair edges"]
    nothing = Onset(None, None, None, None, None, math.inf, 1e-3, "well-posed", None, None)
    never = dataclasses.replace(truth_at(content, WELL).own, onset=nothing)
    assert dict(conditioning(never, UNTIL)) == {"First slip": "none until 2.1 s", "Stair edges": "none until 2.1 s"}


def test_first_slips_are_marked_on_the_needed_friction(content: ReportContent, slipping: tuple[Outcome, Store]) -> None:
    """The bound and every onset, on that curve alone and only where friction is bounded."""
    entries = mark(content.comparisons[0], point_curves(slipping[0]))
    by_point = {entry.point: {item.name: item for item in entry.observables} for entry in entries}
    marked = by_point[point_name(WELL)][CURVE]
    assert [item.row for item in marked.marks or ()] == [-1, 0, 1]
    assert marked.bounds == [Bound("μ static", 0.35)]
    assert not any(item.marks for item in by_point[point_name(FREE)].values())
    assert "marks" not in plain(by_point[point_name(WELL)]["z"])


def test_page_shows_ill_posed_points_without_colour(content: ReportContent, slipping: Any, parse: Any) -> None:
    """A sign and a word for the verdict, its meaning in the legend, and no blame for other events."""
    html = whole(shown(content, slipping))
    text = " ".join(parse(html).text.split())
    assert '<span aria-hidden="true">?</span><span class="vh">ill-posed</span>' in html
    assert '<b class="v ill-posed">? ill-posed here</b>' in html
    assert 'title="refused: needs &lt;b&gt;more&lt;/b&gt;">⊘ refused</b>' in html
    assert MEANINGS["ill-posed"] in text
    assert "? 6, not 1" in text
    assert "✗ 6, not 2" in text
    assert "needs <b>more</b>" in text, "shown as text"
    assert "and 3 points" not in text
    assert "3 points of their own" in text


def test_every_verdict_can_be_said(content: ReportContent) -> None:
    """Signs, meanings and terminal know every verdict."""
    assert set(SYMBOLS) == set(MEANINGS) == {verdict.value for verdict in Verdict}
    assert len(set(SYMBOLS.values())) == len(SYMBOLS)
    first, *others = content.comparisons[0].rows
    first = dataclasses.replace(first, verdict=Verdict.ILL_POSED, verdicts={"ill-posed": 1})
    changed = dataclasses.replace(content.comparisons[0], rows=[first, *others])
    out = console()
    with out.capture() as capture:
        for part in verdict_parts(changed):
            out.print(part)
    assert "\n? " in capture.get()
    assert "1 is ill-posed" in " ".join(capture.get().split())


def test_findings_leave_ill_posed_points_out(content: ReportContent) -> None:
    """Nobody is measured there, and a sentence says where that is; wrong orders elsewhere are named."""
    comparison = content.comparisons[0]
    assert comparison.evidence
    said = " ".join(comparison.evidence.findings.sentences)
    assert (
        "In 1 of 2 cases the first slip is ill-posed (speed=4, rolling_resistance=0.0005, mu_static=0.391459)" in said
    )
    assert "than the truth's: beta (1 of 1 cases) and gamma (1 of 1 cases)." in said


def test_events_without_numbers_do_not_break_the_page(content: ReportContent, slipping: Any) -> None:
    """What is not finite is null in the data and a dash on the page."""
    empty = [Event("slip", math.nan, math.nan, math.nan), Event("slip", 1.0, -math.inf, math.inf)]
    runs = [
        dataclasses.replace(run, own=dataclasses.replace(run.own, events=empty if run.own.events else []))
        for run in content.comparisons[0].runs
    ]
    changed = dataclasses.replace(content.comparisons[0], runs=runs)
    assert "no bracket" in shown(dataclasses.replace(content, comparisons=[changed]), slipping)


@pytest.mark.parametrize(
    ("event", "said"),
    [
        ((1.7205, 1.72, 1.721), ("1.7205", "±5e-4")),
        ((1.72018317162, 1.72018317161, 1.72018317163), ("1.720183172", "±1e-11")),
        ((1.5, 1.5, 1.5), ("1.5", "±0")),
        ((1.0, 0.9, 1.001), ("1.000", "-0.1 +1e-3")),
    ],
)
def test_times_are_shown_to_the_digits_of_their_brackets(event: tuple[float, ...], said: tuple[str, str]) -> None:
    """No digit that the bracket takes away."""
    slip = Event("slip", *event)
    assert (clock(slip), bracket(slip)) == said


@pytest.mark.drill
def test_written_report_names_no_finite_number_it_has_not(slipping: tuple[Outcome, Store], tmp_path: Path) -> None:
    """The file is JSON that every reader accepts, infinite distances included."""
    begun([slipping[0]], COMMAND).write(tmp_path)
    text = (tmp_path / "report.json").read_text(encoding="utf-8")
    assert "Infinity" not in text
    assert "NaN" not in text
