from __future__ import annotations

import math

import numpy as np
import pytest

from proofroll.core.convergence import floor_of, richardson, tightest

T = np.linspace(0, 2, 21)
LIMIT = np.sin(3 * T)


def curve(h: float, power: float, next_term: float = 0.3) -> np.ndarray:
    """A curve with error h^p cos t plus a term one order smaller."""
    return LIMIT + h**power * np.cos(T) + next_term * h ** (power + 1) * T


@pytest.mark.parametrize("power", [1, 2, 4])
@pytest.mark.parametrize("ratio", [2.0, 3.0])
def test_richardson_recovers_order_and_limit(power: int, ratio: float) -> None:
    """From three curves with errors h^p and h^(p+1) the order is seen, and the limit is exact to round-off."""
    h = 1e-2
    found = richardson([curve(h * ratio**k, power) for k in (2, 1, 0)], (ratio**2, ratio, 1))
    assert found.order == pytest.approx(power, abs=0.05)
    assert found.values == pytest.approx(LIMIT, abs=1e-12)
    # Three curves cannot exclude a term h^(p-1), so that the bar is larger than what is left. The laws
    # are given, so that no round-off comes in.
    assert found.error_bar < 0.2 * np.max(np.abs(curve(h, power) - LIMIT))


@pytest.mark.parametrize("power", [1, 2, 4])
def test_steps_need_not_fall_evenly(power: int) -> None:
    """Steps like 5, 2, 1 give the same order and limit as steps of one ratio."""
    steps = (5e-2, 2e-2, 1e-2)
    found = richardson([curve(h, power) for h in steps], steps)
    assert found.order == pytest.approx(power, abs=0.1)
    assert found.values == pytest.approx(LIMIT, abs=1e-12)


def test_error_bar_covers_the_error() -> None:
    """With terms beyond the two that are removed the limit is off by no more than its error bar."""
    for power in (1, 2, 3, 4):
        curves = [curve(h, power) + 5 * h ** (power + 2) * np.sin(7 * T) for h in (0.08, 0.04, 0.02)]
        found = richardson(curves, (4, 2, 1))
        assert 0 < np.max(np.abs(found.values - LIMIT)) <= found.error_bar


@pytest.mark.parametrize("power", [0.5, 1.5, 2.5])
def test_an_order_that_is_no_integer(power: float) -> None:
    """An order between two integers is seen, and the error bar covers what is left of the error."""
    found = richardson([curve(h, power, 0.0) for h in (0.04, 0.02, 0.01)], (4, 2, 1))
    assert found.order == pytest.approx(power, abs=1e-9)
    assert 0 < np.max(np.abs(found.values - LIMIT)) <= found.error_bar


@pytest.mark.parametrize("declared", [1, None])
def test_an_integer_order_in_disguise(declared: int | None) -> None:
    """Where the next term makes an order 1 look like 1.3 nothing is extrapolated, and the error bar covers the rest."""
    found = richardson([LIMIT + 0.01 * h + 0.001 * h**2 for h in (4, 2, 1)], (4, 2, 1), declared)
    assert found.order == pytest.approx(1.3, abs=0.01)
    assert np.max(np.abs(found.values - LIMIT)) <= found.error_bar


def test_an_order_above_the_schemes_is_chance_in_the_last_change() -> None:
    """A last change that happens to be small leaves a limit of which as much is in doubt as by the scheme's order."""
    coarse, middle = (LIMIT + h * np.sin(5 * T) for h in (0.4, -0.4))
    found = richardson([coarse, middle, middle + 0.1 * np.cos(7 * T)], (4, 2, 1), 1)
    assert np.isnan(found.order), "no scheme has it"
    assert found.error_bar + found.chance >= 0.4


def test_an_order_that_was_not_declared() -> None:
    """Curves of the first order are extrapolated by it, whatever was declared; where they scatter they are not."""
    curves = [curve(h, 1) for h in (0.04, 0.02, 0.01)]
    found = richardson(curves, (4, 2, 1), 4)
    assert found.order == pytest.approx(1, abs=0.05)
    assert np.max(np.abs(found.values - LIMIT)) <= found.error_bar < 1e-3
    scattered = [curves[0], curves[1] + 5e-3 * np.sin(9 * T) * np.sin(3 * T), curves[2]]
    rough = richardson(scattered, (4, 2, 1), 4)
    assert rough.values is scattered[-1]


def test_changes_of_two_shapes_are_not_extrapolated() -> None:
    """Changes that fall as those of an order do, but not along one curve, are no order: the finest curve is kept."""
    fine = LIMIT + 1e-3 * np.cos(T)
    middle = fine + 1e-3 * np.sin(9 * T)
    coarse = middle + 4e-3 * np.max(np.abs(np.sin(9 * T))) * np.cos(5 * T)
    found = richardson([coarse, middle, fine], (4, 2, 1), 4)
    assert np.isnan(found.order)
    assert found.values is fine
    assert found.error_bar >= 1e-3


def test_a_limit_that_is_not_the_truth_stays_wrong() -> None:
    """Extrapolation finds the limit of the curves, whatever the truth is."""
    found = richardson([curve(h, 2) + 0.01 for h in (0.04, 0.02, 0.01)], (4, 2, 1))
    assert found.values == pytest.approx(LIMIT + 0.01, abs=1e-9)


def test_curves_that_do_not_converge() -> None:
    """Scattered curves have no order, and an error bar as large as the scatter."""
    scatter = [LIMIT, LIMIT + 0.1 * np.cos(T), LIMIT - 0.1 * np.cos(T)]
    found = richardson(scatter, (4, 2, 1))
    assert math.isnan(found.order)
    assert found.error_bar == pytest.approx(0.2)
    assert found.values is scatter[-1]
    assert not found.shown


def test_round_off_that_an_unstable_motion_enlarges_shows_no_order() -> None:
    """In single precision differences far above round-off show no order below the first; in doubles they do."""
    curves = [curve(h, 0.49) for h in (4e-3, 2e-3, 1e-3)]
    assert richardson(curves, (4, 2, 1)).order == pytest.approx(0.49, abs=0.01)
    single = richardson(curves, (4, 2, 1), 4, scatter=1e-6)
    assert math.isnan(single.order)
    assert single.rounded
    assert not single.shown


@pytest.mark.parametrize(("noise", "order"), [(0.0, 2.0), (1.0, math.nan)])
def test_in_single_precision_one_law_of_the_step_has_an_order(noise: float, order: float) -> None:
    """Differences near round-off show their order where all have one shape; changes of several shapes show none."""
    first, middle, fine = (curve(h, 2) for h in (4e-2, 2e-2, 1e-2))
    last = float(np.max(np.abs(fine - middle)))
    found = richardson([first, middle, fine + noise * last * np.cos(9 * T)], (4, 2, 1), 2, scatter=last / 10)
    assert found.order == pytest.approx(order, abs=0.1, nan_ok=True)
    assert found.rounded is bool(noise)


@pytest.mark.parametrize("curves", [(0.1, 0.0, 0.0), (0.1, 0.1, 0.0), (0.1, 0.1 + 1e-9, 0.0)])
def test_tolerances_that_change_round_off_alone_are_saturated(curves: tuple[float, ...]) -> None:
    """Where one of two tightenings changes nothing, something else limits the steps: the bar is the other change."""
    found = tightest([LIMIT + off for off in curves])
    assert found.saturated
    assert not found.shown
    assert found.error_bar == pytest.approx(0.1, rel=1e-6)


def test_equal_curves() -> None:
    """Curves that do not depend on the step are their own limit, with no order."""
    found = richardson([LIMIT, LIMIT, LIMIT], (4, 2, 1))
    assert math.isnan(found.order)
    assert found.error_bar == 0
    assert found.shown
    growing = richardson([LIMIT, LIMIT, LIMIT + 1e-3], (4, 2, 1))
    assert math.isnan(growing.order)
    assert not growing.shown


@pytest.mark.parametrize("last_digits", [-1e-13, 0.0, 1e-13])
def test_changes_of_whole_steps_have_one_bar(last_digits: float) -> None:
    """A time told in steps that changes by two of them, then by nine, has a bar that no last digit changes."""
    off = 1e-3 * np.array([0.0, 2.0, 11.0 + last_digits])
    found = richardson([LIMIT + one for one in off], (4, 2, 1))
    assert found.error_bar == pytest.approx(9e-3 * (4.5 + 4.5**2 + 4.5**3) / 3)


def test_a_time_told_in_whole_steps() -> None:
    """Where the last refinement changes nothing, the limit is as uncertain as the one before changed it."""
    assert richardson([LIMIT + 0.2, LIMIT, LIMIT], (4, 2, 1)).error_bar == pytest.approx(0.2)


def test_a_difference_that_vanishes_at_once_shows_a_limit() -> None:
    """Too fast for any order, but nothing that scatters: the limit is shown, as uncertain as the change before."""
    found = richardson([LIMIT + 0.2, LIMIT + 1e-13, LIMIT], (4, 2, 1))
    assert math.isnan(found.order)
    assert found.shown
    assert found.error_bar == pytest.approx(0.2)


def test_tightest() -> None:
    """An adaptive method's limit is its tightest curve, as uncertain as the last tightening."""
    found = tightest([LIMIT + 1e-3, LIMIT + 1e-5, LIMIT])
    assert found.values is not None
    assert np.array_equal(found.values, LIMIT)
    assert found.error_bar == pytest.approx(1e-5)
    assert math.isnan(found.order)
    assert found.shown
    assert not tightest([LIMIT, LIMIT + 1e-5, LIMIT - 1e-5]).shown


@pytest.mark.parametrize("ratio", [0.3, 0.998, 1.0, 1.002, 3.0])
def test_changes_of_round_off_are_no_slow_convergence(ratio: float) -> None:
    """Two tightenings that change some hundred last digits leave that uncertainty, whatever their ratio."""
    values, digits = 31.7 * np.ones(5), 8e-13
    found = tightest([values, values + digits, values + digits + ratio * digits])
    assert found.shown
    assert found.error_bar == pytest.approx(digits * max(1.0, ratio), rel=0.01)


@pytest.mark.parametrize(
    ("errors", "told"),
    [
        ({4e-3: 0.49, 2e-3: 0.51, 1e-3: 0.513}, ""),  # Euler on a top: as large as the motion in doubles, too
        ({4e-3: 3e-4, 2e-3: 2e-5, 1e-3: 2.1e-5}, ""),
        ({4e-3: 1e-5, 2e-3: 2e-6, 1e-3: 9e-6}, "best step 2e-3 s, floor 2e-6 m: single precision"),
        # MJX, RK4 on a body that turns about its middle axis; in doubles 1e-8
        ({4e-3: 0.029, 2e-3: 0.048, 1e-3: 0.015}, "best step 1e-3 s, floor 0.015 m: single precision"),
    ],
)
def test_a_floor_is_told_where_shorter_steps_are_worse(errors: dict[float, float], told: str) -> None:
    """Errors of the size of the motion are no floor, nor are those that hardly rise."""
    assert floor_of(errors, 1.0, "m") == told


def test_a_floor_without_a_scale() -> None:
    """Errors of what has no scale are large against none, so that a floor is told whatever their size."""
    assert floor_of({2e-3: 0.4, 1e-3: 0.9}, None, "s") == "best step 2e-3 s, floor 0.4 s: single precision"
