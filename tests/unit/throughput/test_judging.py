"""Copies of one measurement: which are apart, which are not finite, and which is the worst."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from proofroll.core import multi_element
from proofroll.core.engine import Sample
from proofroll.core.errors import Diverged
from proofroll.running.case import Status
from proofroll_throughput.judging import JudgedCopies, twins_apart
from proofroll_throughput.measurement import _InTurn, _written
from proofroll_throughput.picture import drawn, title
from proofroll_throughput.study import Throughput, ThroughputRow, _Measuring
from proofroll_throughput.table import closing_lines, heading, table_of

ROW = ThroughputRow(
    engine="mjx",
    name="MJX f64, dt 1e-3 s",
    device="cpu",
    copies=16,
    worst=2e-2,
    worst_copy=3,
    worst_value=2.2,
    twins_apart=0.0,
    microseconds=1.5,
    seconds_before=9.0,
)
RESULT = Throughput(
    scene="double_pendulum",
    parameter="angle",
    values=(0.5, 2.5),
    until=1.0,
    quantity="q.elbow",
    unit="rad",
    error_bar=1e-12,
    rows=(ROW,),
    date="2026-11-30",
    machine={"processor": "a processor"},
)


def copies(index: int, numbers: list[int], *values: float) -> JudgedCopies:
    """Copies with the same bits, which have these places."""
    states = {"p_WB": np.array(values), "v_WB": np.zeros(len(values))}
    return JudgedCopies(index=index, copies=numbers, states=states, error=0.0)


def test_twins_are_copies_of_one_scene() -> None:
    """Copies of one scene are compared in all samples; one copy of each has no twin, and equal bits are 0 apart."""
    assert twins_apart([copies(0, [0], 1.0), copies(1, [1], 2.0)]) is None
    assert twins_apart([copies(0, [0, 2], 1.0), copies(1, [1], 2.0)]) == 0.0
    assert twins_apart([copies(0, [0, 2], 1.0, 4.0), copies(0, [4], 1.5, 4.0), copies(1, [1], 9.0, 9.0)]) == 0.125


def test_copies_with_the_same_bits_are_written_once(tmp_path: Path) -> None:
    """Each group of a scene has one file; the same state of another scene is a group of its own."""
    first, last = np.zeros((4, 1, 3)), np.zeros((4, 1, 3))
    last[2] = 1.0
    groups = _written([{"p_WB": first}, {"p_WB": last}], [0, 1, 0, 0], {2: "it gave up"}, tmp_path)
    assert [(group["case"], group["copies"], group["failure"]) for group in groups] == [
        (0, [0, 3], ""),
        (1, [1], ""),
        (0, [2], "it gave up"),
    ]
    assert json.loads(json.dumps(groups)) == groups
    assert np.load(tmp_path / "2.npz")["p_WB"].tolist() == [[[0.0] * 3], [[1.0] * 3]]


def test_what_failed_has_a_line_of_its_own() -> None:
    """A row without a measurement is no line of the table, and its reason stands below."""
    refused = ThroughputRow(engine="x", name="X", copies=16, status=Status.REFUSED, message="it has no hinges")
    nothing = replace(ROW, name="Y", worst=None, worst_value=None, twins_apart=None, not_finite=16)
    result = replace(RESULT, rows=(ROW, nothing, refused))
    assert table_of(result).row_count == 2
    assert "X, 16 copies: it has no hinges" in list(closing_lines(result))
    assert "1e-12 rad" in heading(result)


@pytest.mark.drill
def test_the_picture_names_scene_device_and_date() -> None:
    """Title and axes tell what was measured on what; a row without an error is no point."""
    pytest.importorskip("matplotlib")
    failed = replace(ROW, name="Y", worst=None)
    (axes,) = drawn(replace(RESULT, rows=(ROW, replace(ROW, copies=256, microseconds=0.9), failed))).axes
    assert [line.get_xdata().tolist() for line in axes.lines] == [[1e6 / 1.5, 1e6 / 0.9]]
    assert [text.get_text() for text in axes.texts] == ["16", "256"]
    assert axes.get_title() == title(RESULT)
    assert title(RESULT).endswith("cpu: a processor, 2026-11-30")
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")


def measured(device: str, *judged: JudgedCopies) -> ThroughputRow:
    """Row of copies that take 2 ms for 1000 steps of 1 ms each."""
    measuring = _Measuring(
        references=[], values=(0.5, 2.5), times=np.array([0.0, 1.0]), quantity="q.elbow", time_limit=1.0
    )
    answer = {"device": device, "why": "", "seconds_before": 3.0, "seconds": 2e-3, "steps": 1000}
    return measuring._judged(ThroughputRow(engine="x", name="X"), answer, judged)


def test_copies_that_are_not_finite_are_counted_and_the_others_judged() -> None:
    """The worst copy is one with finite states; its number and value are told, and all copies share the cost."""
    low, high = replace(copies(0, [0, 2], 1.0), error=1e-3), replace(copies(1, [1], 1.0), error=2e-2)
    failed = replace(copies(1, [3], np.nan), error=None, failure="it gave up at 0.3 s")
    row = measured("cpu", low, failed, high)
    assert (row.copies, row.not_finite, row.message) == (4, 1, "it gave up at 0.3 s")
    assert (row.worst, row.worst_copy, row.worst_value, row.median) == (2e-2, 1, 2.5, 1e-3)
    assert (row.microseconds, row.seconds_per_second) == (pytest.approx(0.5), pytest.approx(5e-4))
    assert measured("cpu", failed).worst is None


def test_processor_time_tells_no_cost_of_another_device() -> None:
    """Copies on a GPU are judged, and have no cost in processor time."""
    row = measured("cuda:0", copies(0, [0], 1.0))
    assert (row.worst, row.microseconds, row.seconds_per_second) == (0.0, None, None)
    assert row.message == "processor time does not measure cuda:0"


def test_a_run_that_gives_up_leaves_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of runs one after the other one that diverges has no states from then on, and keeps its sentence."""

    class Run:
        def __init__(self, end: float) -> None:
            self.end = end

        def advance(self, t: float) -> None:
            if t > self.end:
                raise Diverged(f"it gave up before {t:g} s")

        def sample(self) -> Sample:
            return Sample(*np.ones((3, 1, 3)))

    monkeypatch.setattr(multi_element, "build", lambda _, scene, __: Run(scene))
    copies_in_turn = _InTurn(None, [0.5, 2.0], [0, 1], None)  # type: ignore[list-item]  # ends of runs in place of scenes
    first = copies_in_turn.arrays()["p_WB"]
    copies_in_turn.advance(1.0)
    copies_in_turn.advance(1.5)
    last = copies_in_turn.arrays()["p_WB"]
    assert np.all(first == 1.0)
    assert (np.isnan(last[0]).all(), np.all(last[1] == 1.0)) == (True, True)
    assert copies_in_turn.failures == {0: "it gave up before 1 s"}
