"""Sweeps over steps and tolerances, on real engines."""

from __future__ import annotations

import pytest

from proofroll.core.errors import InputError
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.sweep import BROKEN, Curve, Question, curves_of, sweep

QUESTION = Question("sphere_in_cylinder", {"speed": 3.0}, 0.4, "z")


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Curve], float]:
    """Curves over steps and over tolerances, and the range of z."""
    curves, absent = curves_of(
        [
            "exudyn[formulation=generic,preset=default]",
            "projection[formulation=rotating_frame]",
            "pinocchio[formulation=composite,preset=matched]",
        ]
    )
    assert absent == {}
    references = sweep(QUESTION, curves, Runner(Store(tmp_path_factory.mktemp("cases"))))
    return {curve.engine: curve for curve in curves}, references[QUESTION.every].sizes["z"]


def test_a_curve_over_steps_begins_where_it_breaks(swept: tuple[dict[str, Curve], float]) -> None:
    """The coarsest step is extended until the run is broken, the finest while the error still falls."""
    curves, scale = swept
    for name in ("exudyn[formulation=generic,preset=default]", "projection[formulation=rotating_frame,preset=default]"):
        points = curves[name].points
        assert len(points) >= 6
        first = points[0]
        assert first.step is not None
        broken = first.result.status != Status.DONE or first.errors["z"] >= BROKEN * scale
        assert broken or first.step == 8 * QUESTION.every
        assert points[-1].errors["z"] < 1e-4 * scale


def test_a_curve_over_tolerances(swept: tuple[dict[str, Curve], float]) -> None:
    """An adaptive formulation is swept over tolerances down to the preset's own."""
    curve = swept[0]["projection[formulation=rotating_frame,preset=matched]"]
    assert not curve.fixed_step
    steps = [point.step for point in curve.points]
    assert steps[-1] == curve.facts.settings["rtol"]
    assert max(steps) >= 1e-2
    # it never breaks: from some tolerance on the sampling interval limits the steps, and no looser one is run
    assert curve.saturated
    assert curve.points[0].errors == curve.points[1].errors
    assert max(steps) < 1e2


def test_a_curve_over_tolerances_begins_where_it_breaks(swept: tuple[dict[str, Curve], float]) -> None:
    """Tolerances are loosened until the run is broken, or until the sampling interval alone limits its steps."""
    curves, scale = swept
    curve = curves["pinocchio[formulation=composite,preset=matched]"]
    first = curve.points[0]
    broken = first.result.status != Status.DONE or first.errors["z"] >= BROKEN * scale
    assert broken or curve.saturated
    assert first.step is not None
    assert first.step >= 1e-1


def test_nothing_of_a_curve_is_lost(swept: tuple[dict[str, Curve], float]) -> None:
    """Every point has a result, and those that reached the end have an error for every observable."""
    for curve in swept[0].values():
        for point in curve.points:
            assert point.result.message
            if point.result.status == Status.DONE:
                assert {"gamma", "z", "N", "F2", "F3", "gap", "slip"} <= point.errors.keys()


def test_engines_that_do_not_exist() -> None:
    """An unknown engine, formulation or setting is an error that names it."""
    for text in ("adams", "exudyn[formulation=none]", "exudyn[wheels=4]"):
        with pytest.raises(InputError):
            curves_of([text])
