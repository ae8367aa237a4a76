"""Causes that a ball's certificate and run prove, and those that its first steps contradict."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from proofroll.core.certificate import Line
from proofroll.core.diagnosis import Evidence, diagnose, hypotheses_of
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.core.truth import truth
from proofroll.elements.ball_on_surface.diagnosis.equations import Law, at_start, residuals_of
from proofroll.elements.ball_on_surface.diagnosis.numbers import _resisting
from proofroll.elements.ball_on_surface.element import rolling_ball, scene_with
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.files.scene_file import load_scene

DYNAMICS = ("acceleration", "angular acceleration")


def lines(
    body: RollingBall, told: RollingBall, names: tuple[str, ...], when: str = "", tolerance: float = 1e-12
) -> list[dict[str, Any]]:
    """Lines of a certificate of a ball about these quantities, which an engine tells of another one."""
    expected, found = at_start(body, Law(body)), at_start(told, Law(told))
    made = []
    for name in names:
        one, other = (np.asarray(numbers[name], dtype=float) for numbers in (expected, found))
        apart = float(np.max(np.abs(other - one))) / float(np.max(np.abs(one)))
        made.append(Line(name + when, "1", tuple(one.tolist()), tuple(other.tolist()), apart, tolerance).as_dict())
    return made


def test_a_number_that_was_built_otherwise_is_the_only_cause() -> None:
    """A ball whose certificate names twice the inertia is told so, and its accelerations accuse nothing else."""
    (element,) = load_scene("sphere_in_cylinder").elements
    body = element.rolling  # type: ignore[attr-defined]  # a ball
    stiffer = replace(body, ball=replace(body.ball, inertia_ratio=0.8))
    evidence = Evidence(element, lines(body, stiffer, ("inertia", *DYNAMICS)))
    (said,) = [cause.says for cause in diagnose(evidence, hypotheses_of(element))]
    assert said.startswith("the engine's model has inertia counted twice (")
    assert not residuals_of(evidence)


@cache
def shell() -> tuple[Any, RollingBall, Any, Any]:
    """A ball, the thin shell of its mass, the shell's run, and the ball's truth."""
    scene, times = load_scene("sphere_in_cylinder"), np.linspace(0.0, 0.4, 21)
    (element,) = scene.elements
    hollow = scene_with(scene, ball=replace(rolling_ball(scene).ball, inertia_ratio=2 / 3))
    return element, rolling_ball(hollow), truth(hollow, times), truth(scene, times)


def shows_inertia(evidence: Evidence) -> bool:
    """True if another inertia is proven."""
    (inertia,) = (item for item in hypotheses_of(evidence.element) if item.id == "inertia")
    return inertia.proven(evidence)


@pytest.mark.parametrize("what", ["report", "run"])
def test_a_law_that_the_first_steps_contradict_is_no_cause(what: str) -> None:
    """Another inertia, in reported accelerations or along a run, is proven unless exact first steps are the scene's."""
    element, hollow, run, true = shell()
    told = lines(element.rolling, hollow, DYNAMICS)
    for first, tolerance, named in ((hollow, 1e-5, True), (element.rolling, 1e-5, False), (element.rolling, 0.3, True)):
        steps = lines(element.rolling, first, DYNAMICS, OF_FIRST_STEPS, tolerance)
        evidence = Evidence(element, steps, run, true) if what == "run" else Evidence(element, told + steps)
        assert shows_inertia(evidence) is named


def test_a_run_proves_no_law_by_its_steps() -> None:
    """Another inertia is not proven where the limit of small steps is the scene's."""
    element, _, run, true = shell()
    assert shows_inertia(Evidence(element, [], run, true))
    assert not shows_inertia(Evidence(element, [], run, true, by_step=True))


@pytest.mark.parametrize(("factor", "named"), [(-1.0, True), (-0.3, False)])
def test_a_resistance_that_drives_is_a_cause_by_its_sign_alone(factor: float, named: bool) -> None:
    """Rolling resistance may have the wrong sign, and no other negative factor on it is anybody's mistake."""
    (element,) = load_scene("sphere_in_cylinder", rolling_resistance=5e-4).elements
    body = element.rolling  # type: ignore[attr-defined]  # a ball
    driven = _resisting(body, factor * body.contact.rolling_resistance)
    evidence = Evidence(element, lines(body, driven, DYNAMICS))
    proven = [cause.says for item in hypotheses_of(element) for cause in item.test(evidence) if cause.proven]
    assert any("rolling resistance" in said for said in proven) is named, proven
