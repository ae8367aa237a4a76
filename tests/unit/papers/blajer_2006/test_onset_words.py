"""What a person reads of first slips."""

from __future__ import annotations

import dataclasses
import io
import re
from math import inf
from pathlib import Path

import pytest
from rich.console import Console

from proofroll.core.errors import InputError
from proofroll.core.events import Event
from proofroll.papers.blajer_2006.commands import _onset_table
from proofroll.papers.blajer_2006.report.onsets import TrueSlips, conditioning
from proofroll.papers.blajer_2006.slip.onset import EngineOnset, OnsetStudy, onset_study, summary
from proofroll.papers.blajer_2006.truth.onset import Onset
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store

AT_ONCE = Onset(0.0, None, None, None, 0.21, 20.0, 1e-3, "well-posed", 0.0, 0.0)


def row(status: Status, first: Event | None, verdict: str) -> EngineOnset:
    """What one engine gave."""
    return EngineOnset("e", "e", {}, status, "why", first, None, verdict)


@pytest.fixture
def table() -> list[list[str]]:
    """The cells of each line, of engines that slip at once, later, never, and cannot."""
    rows = [
        row(Status.DONE, Event("slip", 0.0, 0.0, 2e-323), "agree"),
        row(Status.DONE, Event("slip", 0.0, 0.0, 1e-3), "agree"),
        row(Status.DONE, Event("slip", 0.5, 0.25, 0.75), "disagree"),
        row(Status.DONE, None, "disagree"),
        row(Status.REFUSED, None, "refused"),
    ]
    out = io.StringIO()
    Console(file=out, width=100).print(_onset_table(OnsetStudy("scene", {}, 1.0, AT_ONCE, rows)))
    return [re.split(r"  +", line.strip()) for line in out.getvalue().splitlines()[1:]]


def test_a_slip_from_the_start_is_said_in_words(table: list[list[str]]) -> None:
    """No derivative of a time that does not depend on anything is shown, and no bracket of round-off."""
    said = summary(OnsetStudy("scene", {}, 1.0, AT_ONCE, []))
    assert said.startswith("In the truth the ball slips from the start. The time jumps at mu = 0.21, ")
    assert "none" not in said
    never_jumps = dataclasses.replace(AT_ONCE, edge_above=None, distance=inf)
    said = summary(OnsetStudy("scene", {}, 1.0, never_jumps, []))
    assert said == (
        "In the truth the ball slips from the start. For mu and f known to 0.1 % the question is well-posed."
    )
    assert dict(conditioning(TrueSlips(0.01, 0.01, AT_ONCE, []), 1.0))["First slip"] == "from the start"
    assert [line[1] for line in table] == [
        "from the start",
        "from the start 0 … 0.001",
        "0.5 0.25 … 0.75",
        "no slip",
        "– refused: why",
    ]


def test_a_ball_in_the_air_is_refused(tmp_path: Path) -> None:
    """The friction that rolling needs says nothing of a ball that begins above its wall."""
    with pytest.raises(InputError, match="begins to roll in an upright cylinder"):
        onset_study("bouncing_ball", {"mu_static": 0.3}, Runner(Store(tmp_path), jobs=1))
