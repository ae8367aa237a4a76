"""A budget of processor time, and what a runner does within it."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hostile import ENTRY_POINTS

from proofroll.running.case import Case, Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.running.time_budget import TimeBudget
from proofroll.studies.comparison.default_comparison import default_comparison
from proofroll.studies.comparison.planning import plan


def test_shares_are_never_more_than_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """However cases overlap, each taking all that it may, together they take no more than there is."""
    now = 0.0
    monkeypatch.setattr("proofroll.running.time_budget.time.monotonic", lambda: now)
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: 0.0)
    budget = TimeBudget(100.0)
    for name in "abcdefghi":
        budget.wait(name)
    first = budget.begin("a", 3)
    now, used = 20.0, 0.0
    second = budget.begin("b", 3)
    now = first
    budget.end("a", ended=True)
    used += first
    third = budget.begin("c", 3)
    now += second - (first - 20.0)
    budget.end("b", ended=True)
    used += second
    fourth = budget.begin("d", 3)
    assert used + third + fourth <= 100
    assert min(first, second, third, fourth) > 1


def test_what_a_case_did_not_take_is_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """The processor time of a case counts, not its share; the last one may have all that is left."""
    used = 7.0
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: used)
    budget = TimeBudget(100.0)
    for name in ("a", "b"):
        budget.wait(name)
        assert budget.begin(name, 1) > 85
        used += 1.0
        budget.end(name)
    budget.wait("c")
    assert 80 < budget.begin("c", 8) <= 88


def test_what_comes_after_the_cases_keeps_its_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth is kept for judging what came of them, or what that turns out to take."""
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: 0.0)
    budget = TimeBudget(100.0, 10.0)
    assert budget.left == pytest.approx(80.0)
    budget.after = 35.0
    assert budget.left == pytest.approx(55.0)


def test_each_group_has_an_equal_share(monkeypatch: pytest.MonkeyPatch) -> None:
    """A group that takes all that it may leaves as much to each of the others, and one that takes less leaves more."""
    used = 0.0
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: used)
    budget = TimeBudget(100.0, group={f"{name}{number}": number for number in range(3) for name in "ab"})
    for number in range(3):
        for name in "ab":
            budget.wait(f"{name}{number}")
    for number, spent in enumerate((30.0, 1.0, 1.0)):
        first = budget.begin(f"a{number}", 1)
        assert first == pytest.approx((90.0 - used) / (3 - number))
        used += min(first, spent)
        budget.end(f"a{number}", min(first, spent))
        second = budget.begin(f"b{number}", 1)
        assert second == pytest.approx(first - spent if spent < 20.0 else 0.0)
        budget.end(f"b{number}")


def test_what_is_too_little_for_all_groups_is_for_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fifty groups with a second each would end no truth; the first have what one needs, and others are left out."""
    used = 0.0
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: used)
    names = [f"a{number}" for number in range(50)]
    budget = TimeBudget(50.0, group={name: number for number, name in enumerate(names)})
    for name in names:
        budget.wait(name)
    given = []
    for name in names:
        given.append(budget.begin(name, 1))
        used += given[-1]
        budget.end(name, given[-1])
    assert given == pytest.approx([10.0] * 4 + [5.0] + [0.0] * 45)


@pytest.mark.parametrize("abreast", [2, 8])
def test_cases_that_run_side_by_side_have_no_more_than_their_group(
    abreast: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All cases of a group that begin together may take its share in all, and none begins beyond it."""
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: 0.0)
    monkeypatch.setattr("proofroll.running.time_budget.time.monotonic", lambda: 0.0)
    names = [f"{group}{number}" for group in "abc" for number in range(8)]
    budget = TimeBudget(100.0, group={name: ord(name[0]) for name in names})
    for name in names:
        budget.wait(name)
    given = [budget.begin(f"a{number}", abreast) for number in range(abreast)]
    assert sum(given) == pytest.approx(30.0)
    assert min(given) > 3.0
    budget.end("a0", given[0])
    assert budget.begin("a0", abreast) == 0.0


def test_a_case_that_was_ended_begins_again_with_more_time_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second attempt with less time than the first would be ended as surely."""
    left = 90.0
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: 0.0)
    budget = TimeBudget(100.0, group={"b": 1})
    monkeypatch.setattr(budget, "_left", lambda: left)
    attempts = []
    for left, others in ((90.0, True), (40.0, False), (60.0, False)):  # noqa: B007 - read by _left
        budget.wait("a")
        if others:
            budget.wait("b")
        attempts.append(budget.begin("a", 1))
        budget.end("a", attempts[-1])
        if others:
            budget.begin("b", 1)
            budget.end("b")
    assert attempts == [45.0, 0.0, 60.0]


def test_a_busy_machine_costs_no_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """A case that waits for others, or is ended at its limit after that, counts at most what it was allowed."""
    now = 0.0
    monkeypatch.setattr("proofroll.running.time_budget.time.monotonic", lambda: now)
    monkeypatch.setattr("proofroll.running.time_budget.processor_seconds", lambda: 0.0)
    budget = TimeBudget(100.0, group={"a": 0, "b": 1})
    for name in "ab":
        budget.wait(name)
    assert budget.begin("a", 2) == 45.0
    now = 1000.0
    assert budget.left == 45.0
    budget.end("a", ended=True)
    assert budget.begin("b", 2) == 45.0


def test_what_is_left_is_read_between_two_changes() -> None:
    """Who asks what is left waits until another thread has changed which cases run."""
    budget, found = TimeBudget(100.0), list[float]()
    reading = threading.Thread(target=lambda: found.append(budget.left), daemon=True)
    with budget._lock:
        reading.start()
        reading.join(0.1)
        assert not found
    reading.join(10.0)
    assert found


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("jobs", [pytest.param(1, marks=pytest.mark.drill), 2])
def test_cases_beyond_the_budget_are_left_out(
    tmp_path: Path, make_case: Callable[..., Case], install_engines: Callable[[Mapping[str, str]], None], jobs: int
) -> None:
    """A case that takes what there is ends, those after it are not begun, and the same call goes on with them."""
    install_engines(ENTRY_POINTS)
    slow, quick = make_case("hangs"), make_case("oracle")
    runner, budget = Runner(Store(tmp_path), jobs=jobs), TimeBudget(2.0)
    first = runner.run([slow], budget=budget)[slow.key]
    assert first.status is Status.LEFT_OUT
    assert first.message == "the 2 s of processor time did not suffice"
    second = runner.run([quick, dataclasses.replace(quick, until=0.2)], budget=budget)
    assert {result.status for result in second.values()} == {Status.LEFT_OUT}
    assert {result.status for result in runner.run([quick], budget=TimeBudget(60.0)).values()} == {Status.DONE}


@pytest.mark.nightly
def test_asking_the_engines_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processor time in which workers said what engines are is part of a budget, before any case has begun."""
    clock = iter(range(1000))
    for module in ("default_comparison", "planning"):
        monkeypatch.setattr(f"proofroll.studies.comparison.{module}.processor_seconds", lambda: float(next(clock)))
    assert plan(default_comparison("inclined_plane", {})).comparison.spent == 2.0
    budget = TimeBudget(100.0, 50.0)
    budget.wait("a")
    assert budget.begin("a", 1) <= 40
