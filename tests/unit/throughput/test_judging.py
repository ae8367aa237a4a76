"""Copies of one measurement: which are apart, which are not finite, and which is the worst."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from proofroll.running.case import Status
from proofroll_throughput.judging import JudgedCopies, twins_apart
from proofroll_throughput.measurement import _written
from proofroll_throughput.picture import drawn, title
from proofroll_throughput.study import Throughput, ThroughputRow
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
