"""Causes that a comparison names where the loop around an engine has a mistake in its bookkeeping."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from proofroll.core.diagnosis import Evidence, diagnose, hypotheses_of
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.control import Control
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

STEP = 1e-3


def _with(**changes: object) -> Callable[[Control], Control]:
    return lambda control: dataclasses.replace(control, **changes)  # type: ignore[arg-type]


def _servos(**factors: float) -> Callable[[Mechanism], Mechanism]:
    def changed(mechanism: Mechanism) -> Mechanism:
        servos = (
            dataclasses.replace(item, **{key: factor * getattr(item, key) for key, factor in factors.items()})
            for item in mechanism.actuators
        )
        return dataclasses.replace(mechanism, actuators=tuple(servos))

    return changed


def _controlled(change: Callable[[Control], Control]) -> Callable[[Mechanism], Mechanism]:
    def changed(mechanism: Mechanism) -> Mechanism:
        assert mechanism.control is not None
        return dataclasses.replace(mechanism, control=change(mechanism.control))

    return changed


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("change", "preset", "said"),
    [
        (lambda mechanism: mechanism, "default", None),
        (_controlled(_with(delay=1)), "matched", "targets act one instant late"),
        (_controlled(_with(scale=0.61 * 0.5)), "default", "the scale of actions is 0.61"),
        (_servos(kd=0.7), "matched", "kd is 0.7 of the right one"),
    ],
)
def test_a_comparison_names_a_mistake_in_a_loop(
    change: Callable[[Mechanism], Mechanism], preset: str, said: str | None
) -> None:
    """The run of a wrong loop is explained by its mistake, and a right one by none."""
    scene = load_scene("leg_in_the_air")
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    wrong = dataclasses.replace(scene, elements=(MechanismElement(change(element.mechanism)),))
    run = simulate(wrong, "mujoco", until=0.1, every=0.004, preset=preset, dt=STEP)
    true = truth(scene, np.asarray(run["time"]))
    along = element.along(run)
    causes = diagnose(Evidence(along, [], run, true, STEP, asked=element), hypotheses_of(element))
    assert [cause.says for cause in causes][:1] == [] if said is None else said in causes[0].says


def test_mistakes_are_a_plug_in_of_the_diagnosis() -> None:
    """Mechanisms find the hypothesis by its entry point, and test it before those of single actuators."""
    (element,) = load_scene("leg_in_the_air").elements
    names = [item.id for item in hypotheses_of(element)]
    assert names.count("bookkeeping") == 1
    assert names.index("bookkeeping") < names.index("actuators")
