"""A budget of processor time, and what a runner does within it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hostile import ENTRY_POINTS

from proofroll.running.case import Case, Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.running.time_budget import TimeBudget


def test_shares_are_never_more_than_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """However cases overlap, each taking all that it may, together they take no more than there is."""
    now = 0.0
    monkeypatch.setattr("proofroll.running.time_budget.time.monotonic", lambda: now)
    monkeypatch.setattr("proofroll.running.time_budget.time.process_time", lambda: 0.0)
    budget = TimeBudget(100.0)
    for _ in range(9):
        budget.wait()
    first = budget.begin("a", 3)
    now, used = 20.0, 0.0
    second = budget.begin("b", 3)
    now = first
    budget.end("a", None)
    used += first
    third = budget.begin("c", 3)
    now += second - (first - 20.0)
    budget.end("b", None)
    used += second
    fourth = budget.begin("d", 3)
    assert used + third + fourth <= 100
    assert min(first, second, third, fourth) > 1


def test_what_a_case_did_not_take_is_for_others() -> None:
    """The processor time of a case counts, not its share; the last one may have all that is left."""
    budget = TimeBudget(100.0)
    for name in ("a", "b"):
        budget.wait()
        assert budget.begin(name, 1) > 85
        budget.end(name, 1.0)
    budget.wait()
    assert 80 < budget.begin("c", 8) <= 88


@pytest.mark.parametrize("jobs", [1, 2])
def test_cases_beyond_the_budget_are_left_out(
    tmp_path: Path, make_case: Callable[..., Case], install_engines: Callable[[Mapping[str, str]], None], jobs: int
) -> None:
    """A case that takes what there is ends, those after it are not begun, and the same call goes on with them."""
    install_engines(ENTRY_POINTS)
    slow, quick = make_case("hangs"), make_case("oracle")
    runner, budget = Runner(Store(tmp_path), jobs=jobs), TimeBudget(4.0)
    first = runner.run([slow], budget=budget)[slow.key]
    assert first.status is Status.LEFT_OUT
    assert first.message == "the 4 s of processor time for a first look did not suffice"
    second = runner.run([quick, dataclasses.replace(quick, until=0.2)], budget=budget)
    assert {result.status for result in second.values()} == {Status.LEFT_OUT}
    assert {result.status for result in runner.run([quick], budget=TimeBudget(60.0)).values()} == {Status.DONE}
