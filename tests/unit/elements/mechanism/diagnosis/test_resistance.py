"""Causes of another rolling resistance than the scene's."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import proofroll
from proofroll.core.diagnosis import Evidence, diagnose, hypotheses_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene

ENGINE = "projection[formulation=dependent,rtol=1e-8]"


def sliding(law: Any) -> Scene:
    """A ball that slides forward and spins backward, with a law of resistance."""
    scene = load_scene("slide_to_roll", speed=1.0, back_spin=60.0, rolling_resistance=2e-3)
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    pairs = tuple(replace(pair, against=law) for pair in element.mechanism.pairs)
    return replace(scene, elements=(MechanismElement(replace(element.mechanism, pairs=pairs), local=element.local),))


def causes(law: Any) -> list[str]:
    """Causes of a run with a law, in the scene whose resistance is against motion."""
    scene, run = sliding("motion"), proofroll.simulate(sliding(law), ENGINE, until=0.2, every=0.01)
    true, element = truth(scene, np.asarray(run["time"])), scene.elements[0]
    return [cause.says for cause in diagnose(Evidence(element, [], run, true, None), hypotheses_of(element))]


@pytest.mark.drill
def test_resistance_against_turning_is_named() -> None:
    """A run by the law of bodies is explained in the scene of a ball."""
    assert causes("turning") == [
        "the rolling resistance is against turning where the ball slips, not against its motion"
    ]


@pytest.mark.nightly
def test_the_law_of_the_scene_is_not_accused() -> None:
    """A run by the scene's own law has no cause of a difference."""
    assert causes("motion") == []
