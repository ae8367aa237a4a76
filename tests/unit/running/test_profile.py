"""Processor time of a command by phase."""

from __future__ import annotations

import time

import pytest

from proofroll.running.case import Result, Status
from proofroll.running.time_budget import START, TIMING, TRUTHS, ProcessorProfile


def spend(seconds: float) -> None:
    """Uses processor time of this process [s]."""
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def test_a_phase_within_another_is_taken_off_it() -> None:
    """Each second belongs to the innermost open phase, and all phases together are the total."""
    profile = ProcessorProfile()
    with profile.phase("outer"):
        spend(0.02)
        with profile.phase("inner"):
            spend(0.05)
    total = profile.total
    assert profile.phases["inner"] > profile.phases["outer"] > 0
    assert sum(profile.phases.values()) == pytest.approx(total)


def test_parts_of_a_case_belong_to_phases_of_their_own() -> None:
    """Its truth, its clean runs and its start leave the phase in which it was run; activities are counted besides."""
    profile = ProcessorProfile()
    assert profile.total > 0, "it counts from the start of the process on"
    before = profile.phases[START]
    with profile.phase("search"):
        spent = {"process start": 1.0, "truth": 2.0, "clean runs": 4.0, "advance": 8.0}
        profile.add(Result(Status.DONE, "", processor=spent))
    assert (profile.phases[TRUTHS], profile.phases[TIMING]) == (2.0, 4.0)
    assert profile.phases[START] - before == pytest.approx(1.0, abs=0.5)
    assert profile.phases["search"] == pytest.approx(-7.0, abs=0.5)
    assert profile.activities["advance"] == 8.0


def test_workers_go_on_while_this_process_judges(monkeypatch: pytest.MonkeyPatch) -> None:
    """What workers use meanwhile belongs to the phase around, in which they were asked."""
    used = [0.0]
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: time.process_time() + used[0])
    profile = ProcessorProfile()
    with profile.phase("comparisons"), profile.phase("judging"):
        used[0] = 100.0
    assert profile.total > 0
    assert profile.phases["comparisons"] == pytest.approx(100.0, abs=1.0)
    assert profile.phases["judging"] < 1.0
