"""How a cause is proven, and which of several are told."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from proofroll.core.diagnosis import CLOSES, Cause, Evidence, Hypothesis, diagnose
from proofroll.core.diagnosis.fitting import CauseRow, Residuals, possible
from proofroll.core.diagnosis.vectors import ReportedVector, product
from proofroll.core.errors import NotUnique

FITTED = Cause("x", "it does x", "motion", "m", 1.0, 1e-9, "do y", fitted=1)


def _told(*causes: Cause) -> list[str]:
    hypotheses = [Hypothesis(cause.id, "", lambda _, cause=cause: [cause]) for cause in causes]  # type: ignore[misc]  # one each
    return [cause.id for cause in diagnose(Evidence(None, []), hypotheses)]


@pytest.mark.parametrize(("explains", "proven"), [(1, False), (2, True), (None, True)])
def test_a_cause_explains_more_numbers_than_it_has_free_ones(explains: int | None, proven: bool) -> None:
    """One fitted number proves nothing by one number that it closes."""
    assert dataclasses.replace(FITTED, explains=explains).proven is proven


def test_of_two_fitted_numbers_that_explain_the_same_neither_is_told() -> None:
    """Where two numbers close a difference alike, nobody knows which; without a fit both are told."""
    other = dataclasses.replace(FITTED, id="z", after=2e-9)
    assert _told(FITTED) == ["x"]
    assert _told(FITTED, other) == []
    assert _told(dataclasses.replace(FITTED, fitted=0), dataclasses.replace(other, fitted=0)) == ["x", "z"]


def test_a_hypothesis_without_a_unique_motion_costs_no_other_cause() -> None:
    """Causes before the model that moves in no unique way are told, its own and those of other hypotheses."""

    def open_in_the_end(_: Evidence) -> Iterator[Cause]:
        yield dataclasses.replace(FITTED, fitted=0)
        raise NotUnique("friction tears")

    later = dataclasses.replace(FITTED, id="z", fitted=0)
    hypotheses = [Hypothesis("x", "", open_in_the_end), Hypothesis("z", "", lambda _: [later])]
    assert [cause.id for cause in diagnose(Evidence(None, []), hypotheses)] == ["x", "z"]


def test_what_a_method_does_by_itself_takes_the_proof_from_others() -> None:
    """A number within a hundredth of the scene's accuses nobody, and what needs more does not take its place."""
    coarse = dataclasses.replace(FITTED, id="z", change=9e-3)
    assert _told(coarse, dataclasses.replace(FITTED, fitted=3)) == []


def test_only_loads_have_a_wrong_sign() -> None:
    """Gravity may point upwards, not by a factor that nobody makes; no mass, inertia or armature is negative."""
    assert [possible(factor, signed=True) for factor in (-1.0, -0.127, 0.5)] == [True, False, True]
    assert [possible(factor, signed=False) for factor in (-1.0, -0.127, 0.5)] == [False, False, True]


def _vectors(true: Any, said: Any, **more: Any) -> ReportedVector:
    time = np.arange(len(true)) * 0.01
    return ReportedVector("w_WB", "the angular velocity", "rad/s", np.asarray(said), np.asarray(true), time, **more)


def test_a_limit_that_one_number_meets_is_none() -> None:
    """A constant that is too small everywhere is no limit; one that cuts off a curve is."""
    time = np.linspace(0, 1, 40)[:, None]
    constant = np.ones((40, 1)) * [0.0, 0.0, 2.0]
    curve = np.hstack([np.sin(5 * time), np.cos(3 * time), 0 * time])
    for true, clamped in ((constant, False), (curve, True)):
        limit = 0.9 * np.max(true)
        found = [cause for cause in _vectors(true, np.clip(true, -limit, limit)).causes(1e-3) if cause.proven]
        assert any("clamped" in cause.id for cause in found) is clamped


def test_differences_within_ten_bars_of_the_truth_are_none() -> None:
    """What is not known of the truth has no cause, nor has round-off of a quantity that should be zero."""
    true, said = np.full((20, 3), 1e-7), np.zeros((20, 3))
    assert [cause for cause in _vectors(true, said).causes(1e-3) if cause.proven]
    assert not list(_vectors(true, said, bar=1e-7).causes(1e-3))
    assert not list(_vectors(true, said, least=10.0).causes(1e-3))


def test_a_component_that_is_not_determined_spoils_those_in_which_it_has_a_share() -> None:
    """In a plane the moment about its normal needs no force along it; turned out of the plane nothing is known."""
    unknown = np.array([[1.0, 2.0, np.nan]])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(product(turn[None], unknown), [[-2.0, 1.0, np.nan]])
    assert np.all(np.isnan(product(np.ones((1, 3, 3)), unknown)))


def test_a_model_that_contradicts_a_right_report_proves_nothing() -> None:
    """A model that closes the difference is a cause, unless it contradicts what the engine reports rightly."""
    for contradicts in (True, False):
        residuals = Residuals(
            lambda size: np.array([1.0 - (size or 0.0)]), "motion", "m/s^2", 1.0, CLOSES, (), 0.0, list,
            lambda _, contradicts=contradicts: contradicts,
        )  # fmt: skip
        assert residuals.cause(CauseRow("mass", "it moves so", 1.0, "look")).proven is not contradicts
