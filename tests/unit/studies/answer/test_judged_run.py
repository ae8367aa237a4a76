"""A run held against the truth: errors, the time until which they are small, and limits of small steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from proofroll.running.case import Status
from proofroll.studies.answer.judged_run import JudgedRun, least_of_limit

ALLOWED = {"x": 1e-3, "y": 1.0}
TIMES = np.linspace(0.0, 4.0, 5)


def run(**changes: object) -> JudgedRun:
    """A run whose x grows beyond what is allowed at its fourth sample; y has no value at the first."""
    values = {
        "step": 1e-3, "status": Status.DONE, "errors": {"x": 2e-3, "y": 0.1}, "times": TIMES,
        "growth": {"x": np.array([0.0, 1e-4, 1e-3, 2e-3, 2e-3]), "y": np.full(4, 0.1)},
    }  # fmt: skip
    return JudgedRun(**(values | changes))  # type: ignore[arg-type]  # fields by name


def test_the_worst_quantity_is_that_with_the_largest_part_of_what_is_allowed() -> None:
    """Errors are compared by what is allowed; without a result it is infinite, and a silent quantity is no error."""
    assert run().of_allowed(ALLOWED) == pytest.approx(2.0)
    assert run().worst(ALLOWED) == "x"
    assert run(status=Status.DIVERGED).of_allowed(ALLOWED) == math.inf
    assert run().of_allowed(ALLOWED | {"z": 1.0}) is None


def test_a_tolerance_is_held_up_to_the_last_sample_within_it() -> None:
    """Of several quantities the first that leaves what is allowed ends it; one that starts beyond it held never."""
    assert run().held_until(ALLOWED) == 2.0
    assert run().held_until({"y": 1.0}) == 4.0
    assert run().held_until({"y": 0.01}) == 0.0
    assert run().held_until({"an event": 1.0}) == 0.0


def test_few_samples_count_where_their_error_is_larger() -> None:
    """A scheme that adapts its steps has the larger error of many and of few samples, or the failure of the latter."""
    sparse = run(errors={"x": 5e-3, "y": 0.01}, spent=1.0)
    assert run().with_sparse(sparse).errors == {"x": 5e-3, "y": 0.1}
    failed = run().with_sparse(run(status=Status.DIVERGED, message="too short"))
    assert (failed.status, failed.message) == (Status.DIVERGED, "sampled seldom: too short")


def test_a_limit_is_off_by_what_falling_changes_cannot_take_away() -> None:
    """Changes of 0.4, 0.2 can still fall by 0.4 more, twice counted; changes that do not fall show no limit."""

    def curve(value: float) -> JudgedRun:
        return run(curves={"x": np.full((2, 1), value)}, true={"x": np.zeros((2, 1))}, errors={"x": value})

    falling = curve(5.6), curve(5.2), curve(5.0)
    assert least_of_limit(falling, {"x": 1.0}) == pytest.approx(5.0 - 2 * 0.2)
    assert least_of_limit((curve(5.6), curve(5.3), curve(5.0)), {"x": 1.0}) == 0.0
    assert least_of_limit((curve(4e-3), curve(1e-3), curve(2.5e-4)), {"x": 1.0}) <= 0.0
