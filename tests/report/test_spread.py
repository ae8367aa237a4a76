"""Scenes without a unique truth: laws alone are judged, and the spread of the settings is shown without a ranking."""

from __future__ import annotations

import dataclasses
import io
from typing import Any

import numpy as np
import pytest
from flat_judging import judged_curve
from folded import whole
from rich.console import Console

from proofroll.core.observable import Role
from proofroll.files.json_data import plain
from proofroll.report.comparison.plots import point_curves
from proofroll.report.comparison.summary import outcome_content
from proofroll.report.page.html import page
from proofroll.report.page.records import ReportContent, report_content
from proofroll.report.terminal.verdicts import verdict_parts
from proofroll.running.case import Status
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import ComparedPoint, Outcome, Run


def _unsure(point: ComparedPoint) -> ComparedPoint:
    """The point with a truth that is one of several."""
    assert point.reference is not None
    made, true = dataclasses.replace(point), point.reference
    vars(made)["reference"] = dataclasses.replace(true, dataset=true.dataset.assign_attrs(ill_posed="two hit at once"))
    return made


def _lawful(outcome: Outcome, run: Run, error: float) -> Run:
    """The run, judged by a law alone."""
    law = next(key for key, item in outcome.scene.observables.items() if item.role is Role.RESIDUAL)
    item = judged_curve(
        law, "m", np.full(3, error), np.zeros(3), truth_error_bar=0.0, tolerance=1e-3, scale=1.0, limit=None
    )
    return dataclasses.replace(run, judgements=[item], missing=[], contradictions=[])


def _alone(outcome: Outcome, error: float = 1e-6) -> Outcome:
    """The comparison with no unique truth at any of its points."""
    points = {name: _unsure(point) for name, point in outcome.points.items()}
    runs = [_lawful(outcome, run, error) if run.result.status is Status.DONE else run for run in outcome.runs]
    return dataclasses.replace(outcome, points=points, runs=runs)


@pytest.fixture(scope="module")
def alone(made: tuple[Outcome, Store]) -> Outcome:
    """Two points without a unique truth; all that ran keeps the law."""
    return _alone(made[0])


@pytest.fixture(scope="module")
def content(alone: Outcome) -> ReportContent:
    """Its report."""
    return report_content([alone], "proofroll report invented")


def said(content: ReportContent) -> str:
    """All sentences of a report."""
    own = content.comparisons[0].evidence
    assert own is not None
    return " ".join([*content.findings, own.findings.answer, *own.findings.sentences])


def test_points_are_held_to_laws_alone_where_no_truth_is_unique_and_no_motion_is_judged(
    made: tuple[Outcome, Store], alone: Outcome
) -> None:
    """A unique truth, or a motion that is judged all the same, makes an ordinary point of it."""
    assert alone.laws_alone == list(alone.points)
    assert made[0].laws_alone == []
    assert dataclasses.replace(alone, points=made[0].points).laws_alone == []
    assert dataclasses.replace(alone, runs=made[0].runs).laws_alone == []


def test_no_sentence_speaks_of_agreement_with_a_truth(content: ReportContent) -> None:
    """First screen, findings and advice speak of laws that are kept, name nobody as closest, and say why."""
    text = said(content)
    for word in ("with the truth", "from the truth", "Closest", "closest is", "obvious model", "nothing was run"):
        assert word not in text, word
    assert content.findings[0].startswith(
        "Of 4 settings judged by laws of mechanics alone, as there is no unique truth (invented), 3 keep the "
        "laws that are judged in every case and 1 gives no result at some points."
    )
    assert content.findings[1] == "No setting that ran to its end breaks a law of mechanics."
    assert "3 keep the laws that are judged in every case" in text


def test_a_broken_law_is_called_one(made: tuple[Outcome, Store]) -> None:
    """Who breaks a law differs from no truth, and its reason is told."""
    sentences = report_content([_alone(made[0], 0.1)], "").findings
    assert "3 break a law at some points" in sentences[0]
    assert sentences[1].startswith("3 settings break a law of mechanics and run to the end without a warning, worst ")
    assert "truth" not in sentences[1].partition(":")[0]


def test_the_spread_has_each_setting_and_the_range(alone: Outcome) -> None:
    """At each point the last values of the motion, in the order of the rows, with the least and the largest."""
    found = outcome_content(alone).spread
    assert [item.point for item in found] == list(alone.points)
    for item in found:
        assert (item.because, item.time) == ("two hit at once", alone.comparison.until)
        (line,) = (line for line in item.lines if line.name == "z")
        ends = [
            None if run.trajectory is None else float(run.trajectory.dataset["z"][-1])
            for run in alone.runs
            if f"speed={run.parameters['speed']:g}" == item.point
        ]
        assert line.values == ends
        known = [value for value in ends if value is not None]
        assert (line.low, line.high) == (min(known), max(known))


def test_a_run_that_ended_early_has_no_end(alone: Outcome) -> None:
    """What stops before the last time is not set beside what reached it."""
    run = next(run for run in alone.runs if run.trajectory is not None)
    assert run.trajectory is not None
    short = dataclasses.replace(run.trajectory)
    vars(short)["dataset"] = run.trajectory.dataset.isel(time=slice(-1))
    runs = [dataclasses.replace(item, trajectory=short) if item is run else item for item in alone.runs]
    line = outcome_content(dataclasses.replace(alone, runs=runs)).spread[0].lines[0]
    assert line.values[0] is None
    assert line.values[1] is not None


def test_page_terminal_and_json_show_the_spread(alone: Outcome, content: ReportContent, parse: Any) -> None:
    """The table stands on all three, with why there is no truth, and nothing is drawn against one."""
    assert point_curves(alone) == []
    text = " ".join(parse(whole(page(content, [[]]))).text.split())
    assert "Spread of the settings at speed=3" in text
    assert "Judged by laws of mechanics alone, as there is no unique truth: two hit at once." in text
    assert "checked against" not in text
    out = io.StringIO()
    console = Console(file=out, width=100, highlight=False)
    for item in verdict_parts(content.comparisons[0]):
        console.print(item)
    assert "spread of the settings" in out.getvalue()
    assert "two hit at once" in out.getvalue()
    told = plain(content)["comparisons"][0]["spread"][0]
    assert set(told) == {"point", "because", "time", "lines"}
    assert set(told["lines"][0]) == {"name", "unit", "values", "low", "high", "part"}


def test_an_ordinary_comparison_beside_it_is_told_as_ever(made: tuple[Outcome, Store], alone: Outcome) -> None:
    """Beside a comparison with a truth the laws have a clause of their own."""
    ordinary = report_content([made[0]], "").findings
    both = report_content([made[0], dataclasses.replace(alone, comparison=alone.comparison)], "").findings
    assert both[0].startswith(ordinary[0].removesuffix("."))
    assert "; of 4 settings judged by laws of mechanics alone" in both[0]
