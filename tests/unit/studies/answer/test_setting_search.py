"""The search along one setting: which step is advised, and what is said of one that is not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from proofroll.running.case import EngineFacts, Status
from proofroll.studies.answer.judged_run import JudgedRun
from proofroll.studies.answer.setting_search import SettingSearch, State

ALLOWED, SIZES = {"x": 1e-4}, {"x": 1.0}
Law = Callable[[float], float]


def setting(start: int = 0, order: int = 2, resolution: str = "dt") -> SettingSearch:
    """A setting whose coarsest step is 0.1 s, in runs of 10 s."""
    facts = EngineFacts("alpha", "1", "", {"formulation": "only", resolution: 1e-3}, resolution, order)
    first = 0.1 if resolution == "dt" else 1e-3
    return SettingSearch("alpha[formulation=only]", facts, first, 10.0, ALLOWED, SIZES, start)


def run_of(step: float, law: Law, cost: float) -> JudgedRun:
    """A run with an error by a law; an infinite error is a run that broke down."""
    error = law(step)
    if not math.isfinite(error):
        return JudgedRun(step, Status.DIVERGED, "not finite", cost, 0.1, 1.0)
    values, true = np.full((3, 1), error), np.zeros((3, 1))
    growth = np.full(3, abs(error))
    return JudgedRun(
        step=step,
        status=Status.DONE,
        cost=cost,
        spent=10 * cost,
        reached=10.0,
        errors={"x": abs(error)},
        growth={"x": growth},
        times=np.linspace(0, 10, 3),
        curves={"x": values},
        true={"x": true},
    )


def searched(item: SettingSearch, law: Law, each: float = 1e-6, left: float = 30.0) -> SettingSearch:
    """The setting after its search; a step costs ``each`` [s]."""
    for _ in range(60):
        divisor = item.next_divisor(left)
        if divisor is None:
            return item
        assert divisor not in item.runs, "a step is run once"
        step = item.step(divisor)
        item.runs[divisor] = run_of(step, law, each / step)
    raise AssertionError("the search does not end")


@pytest.mark.parametrize("start", [0, 3, 9])
def test_the_coarsest_step_that_holds_is_found_from_either_side(start: int) -> None:
    """Wherever the search begins, it ends with the coarsest halving that holds, confirmed by half of it."""
    item = searched(setting(start), lambda step: 4 * step**2)
    assert item.state is State.HOLDS
    assert item.chosen is not None
    assert item.chosen.step == 0.003125
    assert item.step(2 * 32) in {run.step for run in item.runs.values()}


def test_luck_between_halvings_is_unmasked() -> None:
    """A step whose half holds, but which a step that is no half contradicts, is not advised."""
    lucky, half, between = 0.1 / 8, 0.1 / 16, 0.1 / 10

    def law(step: float) -> float:
        return {lucky: 5.7e-5, half: 4.1e-5, between: 1.19e-4}.get(step, 5e-6 if step < half else 1e-2)

    item = searched(setting(2), law)
    assert item.state is State.HOLDS
    assert item.chosen is not None
    assert item.chosen.step < lucky
    assert "luck" in item.unsafe[3]


def test_errors_out_of_order_need_a_margin() -> None:
    """Where errors do not fall from a step to its half, all that were run have to be half of what is allowed."""
    sizes = {
        0.1 / 8: 0.92,
        0.1 / 10: 0.57,
        0.1 / 16: 0.77,
        0.1 / 20: 0.4,
        0.1 / 32: 0.41,
        0.1 / 40: 0.3,
        0.1 / 64: 0.35,
    }
    item = searched(setting(3), lambda step: 1e-4 * sizes.get(step, 0.2 if step < 1e-3 else 30.0))
    assert item.chosen is not None
    assert item.chosen.step == 0.1 / 32
    assert "order" in item.unsafe[3]


def test_the_last_step_before_a_breakdown_is_not_advised() -> None:
    """A step that holds, where a third more breaks down, gives way to half of it; where it does not, it stays."""
    coarse = 0.1 / 4

    def law(limit: float) -> Law:
        return lambda step: math.inf if step > limit * (1 + 1e-9) else 1e-2 * step**2

    near, far = searched(setting(2), law(coarse)), searched(setting(2), law(1.4 * coarse))
    assert near.chosen is not None
    assert far.chosen is not None
    assert (near.chosen.step, far.chosen.step) == (coarse / 2, coarse)
    assert "breaks down" in near.unsafe[2]


def test_a_limit_off_the_truth_leads_elsewhere() -> None:
    """Three halvings whose changes fall, and whose limit is beyond the tolerance, show that it leads elsewhere."""
    item = searched(setting(3), lambda step: 1e-3 + 0.5 * step)
    assert item.state is State.ELSEWHERE
    assert "limit of small steps" in item.why


def test_no_verdict_from_a_run_that_was_not_made() -> None:
    """Where the tolerance needs steps that are not affordable, the step it needs at best and its time are told."""
    item = searched(setting(3, order=1), lambda step: 0.5 * step, each=1e-3)
    assert item.state is State.FINER
    assert item.needs is not None
    assert item.needs[0] == pytest.approx(2e-4, rel=0.05)
    assert item.needs[1] > 8


def test_a_step_whose_half_is_not_affordable_is_not_confirmed() -> None:
    """A step that holds is told as not confirmed, if half of it costs more than a run may, or nothing is left.

    A short run confirms a step though nothing is left.
    """
    assert searched(setting(5), lambda step: 0.02 * step, each=2e-3).state is State.UNCONFIRMED
    for cost, state in ((0.2, State.UNCONFIRMED), (0.1, State.HOLDS)):  # of 10 s; the next step takes twice as long
        item = setting(5)
        item.runs[32] = run_of(item.step(32), lambda _: 5e-5, cost)
        item.runs[16] = run_of(item.step(16), lambda _: 5e-3, cost)
        assert searched(item, lambda step: 0.02 * step, left=0.0).state is state


def test_errors_that_stay_within_the_tolerance_are_its_own() -> None:
    """A soft contact leaves an error that no step takes away: where it varies less than its margin, no finer is run."""
    item = searched(setting(), lambda step: 6.8e-5 + 1e-2 * step**2)
    assert item.state is State.HOLDS
    assert item.chosen is not None
    assert item.chosen.step == 0.025
    assert min(run.step for run in item.runs.values()) == 0.0125


def test_luck_is_unmasked_where_half_the_step_is_not_affordable() -> None:
    """Where half of a step costs too much, a step between them is run; if it fails, the first held by luck."""
    law = {0.1: 5e-3, 0.05: 5e-3, 0.025: 5e-5, 0.02: 2e-4}
    item = searched(setting(2), lambda step: law[step], each=0.012)
    assert item.step(5) in {run.step for run in item.runs.values()}
    assert item.state is State.FINER
    assert "dt 0.025 s holds by luck: dt 0.02 s is off by 2 times" in "; ".join(item.unsafe.values())
    sound = searched(setting(2), lambda step: (law | {0.02: 5e-5})[step], each=0.012)
    assert (sound.state, sound.chosen and sound.chosen.step) == (State.UNCONFIRMED, 0.025)


def test_a_coarser_run_tells_what_a_step_takes() -> None:
    """The time of a step between two that were run is that of the coarser one by its ratio, not of the finer one."""
    item = setting(5)
    for divisor, error, cost in ((2, 5e-3, 0.01), (4, 5e-5, 0.02), (32, 1e-9, 0.5)):
        item.runs[divisor] = run_of(item.step(divisor), lambda _, error=error: error, cost)
    assert item.next_divisor(0.0) == 8


def test_one_refusal_may_be_that_of_a_step() -> None:
    """A setting that refuses one coarse step is run with finer ones; after three refusals it is refused."""

    def refused(divisors: set[int]) -> SettingSearch:
        item = setting(2)
        while (divisor := item.next_divisor(30.0)) is not None:
            step = item.step(divisor)
            if divisor in divisors:
                item.runs[divisor] = JudgedRun(step, Status.WRONG_MODEL, "gap is off")
            else:
                item.runs[divisor] = run_of(step, lambda step: 1e-2 * step**2, 1e-6 / step)
        return item

    assert refused({4}).state is State.HOLDS
    assert refused({2**n for n in range(12)}).state is State.REFUSED
    assert len(refused({2**n for n in range(12)}).runs) == 3


def test_what_reports_no_forces_is_silent() -> None:
    """A quantity that a run does not report is no error: the setting is told as not reporting it."""
    item = setting(3)
    item.allowed = {"x": 1e-4, "forces": 1.0}
    assert searched(item, lambda step: 1e-2 * step**2).state is State.SILENT


def test_an_adaptive_scheme_is_confirmed_by_a_tighter_tolerance() -> None:
    """The loosest tolerance that holds is advised, with the next tighter one run, too."""
    item = searched(setting(0, resolution="rtol"), lambda rtol: 5 * rtol)
    assert item.state is State.HOLDS
    assert item.chosen is not None
    assert item.chosen.step == 1e-5
    assert 1e-6 in {run.step for run in item.runs.values()}


def test_tolerances_whose_errors_do_not_fall_need_a_margin() -> None:
    """A tolerance that holds barely, as its tenth does, is not advised; with other samples it need not hold."""
    lucky = {1e-3: 6.8e-2, 1e-4: 1.1e-2, 1e-5: 5.3e-3, 1e-6: 5.3e-5, 1e-7: 4.6e-5}
    item = searched(setting(0, resolution="rtol"), lambda rtol: lucky.get(float(f"{rtol:.6g}"), 1e-6), 1e-9)
    assert item.state is State.HOLDS
    assert item.chosen is not None
    assert item.chosen.step == pytest.approx(1e-7)
    assert "from rtol 1e-6 on errors do not fall in order" in "".join(item.unsafe.values())


def test_the_least_cost_is_a_bound() -> None:
    """What a setting can still cost is never more than what its advised step costs in the end."""
    for start in (0, 3, 9):
        item, bounds = setting(start), []
        while (divisor := item.next_divisor(30.0)) is not None:
            item.runs[divisor] = run_of(item.step(divisor), lambda step: 4 * step**2, 1e-6 / item.step(divisor))
            bounds.append(item.least)
        assert item.chosen is not None
        assert max(bounds) <= item.chosen.cost * (1 + 1e-9)
