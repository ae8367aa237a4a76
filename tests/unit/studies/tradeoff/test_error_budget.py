"""Error budgets of curves whose parts are known."""

from __future__ import annotations

import json

import numpy as np
import pytest

from proofroll.core.observable import Observable, Role
from proofroll.files.json_data import plain, record
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.studies.tradeoff.curve import Curve, CurvePoint
from proofroll.studies.tradeoff.error_budget import FLOOR, MODEL_FORM, TIME_STEP, TRUTH, Order, budget, order_of
from proofroll.studies.tradeoff.records import CurveBudget

T = np.linspace(0, 2, 41)
TRUE = np.sin(3 * T)
STEPS = (0.05, 0.025, 0.01, 0.005, 0.002, 0.001)


def made(
    *,
    order: int,
    model: float = 0.0,
    floor: float = 0.0,
    declared: int = 2,
    highest: int | None = None,
    resolution: str = "dt",
    bar: float = 1e-13,
    factor: float = 1.0,
    role: Role = Role.MOTION,
) -> CurveBudget:
    """The budget of runs with errors of known parts."""
    facts = EngineFacts(
        "made", "1", "0", {"dt": 0.1, "rtol": 0.1}, resolution, declared if resolution == "dt" else None, highest
    )
    scatter = np.random.default_rng(1)
    curve = Curve("made", facts)
    for step in STEPS:
        own = EngineFacts(facts.name, "1", "0", {resolution: step}, resolution, facts.order)
        values = TRUE + factor * step**order * np.cos(T) + model * T + floor * scatter.uniform(-1, 1, T.size)
        error = float(np.max(np.abs(values - TRUE)))
        case = Case("scene", {}, "0", own, 2.0, 0.05)
        curve.points.append(CurvePoint(case, Result(Status.DONE, "done"), {"z": values}, {"z": error}, {"z": bar}))
    return budget(curve, "z", 0.05, TRUE, observed(role), 1.0)


def observed(role: Role = Role.MOTION) -> Observable:
    """The observable of the curves, in metres."""
    return Observable("z", "m", "made", role)


@pytest.mark.parametrize("order", [1, 2, 4])
def test_order_with_its_interval(order: int) -> None:
    """The order of the time step is found, its interval holds it, and the declared one is held against it."""
    found = made(order=order, declared=order)
    assert found.order == pytest.approx(order, abs=0.02)
    assert found.order_low is not None
    assert found.order_high is not None
    assert found.order_low <= order <= found.order_high
    assert not found.contradicts_declaration
    assert made(order=order, declared=order + 1).contradicts_declaration
    assert made(order=order, declared=order - 1).contradicts_declaration
    assert not made(order=order, declared=order - 1, highest=order).contradicts_declaration
    assert made(order=order, declared=order - 2, highest=order - 1).contradicts_declaration
    assert found.coarse == found.fine == TIME_STEP
    assert found.floor is None


@pytest.mark.parametrize("role", [Role.REACTION, Role.RESIDUAL])
def test_a_higher_order_contradicts_by_the_motion_alone(role: Role) -> None:
    """Forces and residuals that converge faster than the motion contradict no declaration; slower ones do."""
    assert not made(order=2, declared=1, role=role).contradicts_declaration
    assert made(order=1, declared=2, role=role).contradicts_declaration


def test_round_off_has_no_order() -> None:
    """Runs that differ by round-off alone, as a coordinate that never moves, contradict no declaration."""
    found = made(order=1, factor=1e-13)
    assert found.order is None
    assert not found.contradicts_declaration


def test_model_form_is_what_small_steps_leave() -> None:
    """An error that no step removes is found to its digits, with the uncertainty it is known to, and named."""
    found = made(order=2, model=3e-3)
    assert found.model_form == pytest.approx(6e-3, rel=1e-3)
    assert found.model_form_bar is not None
    assert found.model_form_bar < 1e-5
    assert (found.coarse, found.fine) == (MODEL_FORM, MODEL_FORM)
    assert made(order=1, model=3e-3).coarse == TIME_STEP


@pytest.mark.parametrize("start", [0, 1])
def test_the_coarse_end_is_that_of_the_whole_curve(start: int) -> None:
    """A step longer than the sampling interval counts at its own samples, with a sample at time 0 or without.

    The time step dominates there, although the model does from the sampling interval on.
    """
    curve = Curve("made", EngineFacts("made", "1", "0", {"dt": 0.1}, "dt", 2))
    for step in (0.4, *STEPS):
        every = max(step, 0.05)
        stride = round(every / 0.05)
        t = T[::stride][start:]
        values = np.sin(3 * t) + step**2 * np.cos(t) + 3e-3 * t
        own = EngineFacts("made", "1", "0", {"dt": step}, "dt", 2)
        error = float(np.max(np.abs(values - np.sin(3 * t))))
        case = Case("scene", {}, "0", own, 2.0, every)
        curve.points.append(CurvePoint(case, Result(Status.DONE, "done"), {"z": values}, {"z": error}, {"z": 1e-13}))
    found = budget(curve, "z", 0.05, TRUE[start:], observed(), 1.0)
    assert (found.coarse_step, found.coarse, found.fine) == (0.4, TIME_STEP, MODEL_FORM)
    curve.points[0].curves["z"] = curve.points[0].curves["z"][:-1]
    assert budget(curve, "z", 0.05, TRUE[start:], observed(), 1.0).coarse_step == STEPS[0]


def test_no_model_form_where_there_is_none() -> None:
    """Without such an error what is left is below its own uncertainty, and the sentence says so."""
    found = made(order=2)
    assert found.model_form is not None
    assert found.model_form_bar is not None
    assert found.model_form <= found.model_form_bar + found.truth
    assert "No error of the model itself is seen" in found.sentence


def test_floor_where_refining_no_longer_helps() -> None:
    """Scatter between fine runs is the floor, of its size; an order that shows above it is still found."""
    found = made(order=4, declared=4, floor=1e-8)
    assert found.floor is not None
    assert 3e-9 < found.floor < 1e-7
    assert found.fine == FLOOR
    assert found.order == pytest.approx(4, abs=0.1)


def test_the_truth_limits_what_can_be_said() -> None:
    """A fine run that is nearer to the truth than the truth is known is limited by the truth."""
    assert made(order=2, bar=1e-4).fine == TRUTH


def test_a_truth_without_a_finite_bar_can_be_kept() -> None:
    """A bar that is not finite is none in the budget, which says so, and is read back from JSON as it was."""
    found = made(order=2, bar=np.inf)
    assert (found.truth, found.fine) == (None, TRUTH)
    assert "the truth's error bar is not finite" in found.sentence
    assert record(CurveBudget, json.loads(json.dumps(plain(found), allow_nan=False))) == found


def test_an_adaptive_curve_has_no_order() -> None:
    """Over tolerances no order is claimed, and the sentence speaks of step control."""
    found = made(order=2, resolution="rtol")
    assert (found.order, found.order_low, found.declared) == (None, None, None)
    assert "step control" in found.sentence


def test_too_few_runs() -> None:
    """From fewer than three runs nothing is concluded."""
    facts = EngineFacts("made", "1", "0", {"dt": 0.1}, "dt", 2)
    found = budget(Curve("made", facts), "z", 0.05, TRUE, observed(), 1.0)
    assert found.model_form is None
    assert "oo few runs" in found.sentence


def test_order_from_two_differences_has_no_interval() -> None:
    """Two differences fix an order but say nothing about its uncertainty."""
    found = order_of([4, 2, 1], [12.0, 3.0])
    assert found.value == pytest.approx(2)
    assert (found.low, found.high) == (None, None)


def test_differences_that_do_not_shrink_have_no_order() -> None:
    """Scatter of one size shows no power law."""
    assert order_of([8, 4, 2, 1], [1.0, 1.1, 1.0]) == Order()


def test_an_order_is_told_with_the_steps_it_holds_on() -> None:
    """Differences off the power law at either end are outside the steps for which the order is claimed."""
    steps = [32.0, 16.0, 8.0, 4.0, 2.0, 1.0, 0.5]
    square = [3.0 * step**2 for step in steps[1:]]  # of neighbouring runs, where the error is the square of the step
    assert order_of(steps, square)[3:] == (32.0, 0.5)
    found = order_of(steps, [0.9 * square[1], *square[1:5], 0.9 * square[4]])
    assert found.value == pytest.approx(2)
    assert (found.coarsest, found.finest) == (16.0, 1.0)
    swept = made(order=2)
    assert (swept.order_from, swept.order_to) == (STEPS[0], STEPS[-1])
    assert "from 0.05 s to 1e-3 s" in swept.sentence
