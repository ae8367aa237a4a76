"""Scene files mean to proofroll what they mean to a reader that shares no code with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene
from proofroll_drill.own_reader import MODELS, misread

_LEAST = 800  # numbers of all models that are compared


@pytest.mark.drill
def test_numbers_of_all_models_are_those_of_their_files() -> None:
    """Masses, places, axes, laws, starts and signals are read by text, parameter, formula and unit."""
    compared = 0
    for path in sorted(MODELS.glob("*/scene.toml")):
        for element in load_scene(path.parent.name).elements:
            assert isinstance(element, MechanismElement)
            wrong, count = misread(path.parent.name, element.mechanism)
            assert wrong == [], path.parent.name
            compared += count
    assert compared > _LEAST


FAULTS: dict[str, tuple[str, str, Callable[[Any], Any]]] = {
    "degrees": (
        "joint_bench",
        "joints",
        lambda item: replace(item, orientation=(1.01 * item.orientation[0], 0.0, 0.0)),
    ),
    "a mass": ("heavy_top", "bodies", lambda item: replace(item, mass=item.mass * (1 + 1e-12))),
    "a formula": ("servo", "bodies", lambda item: replace(item, inertia=(0.99 * item.inertia[0][0],) * 3)),
    "a bushing": ("engine_on_mounts", "bushings", lambda item: replace(item, damping=item.damping[::-1])),
}


@pytest.mark.drill
@pytest.mark.parametrize("name", FAULTS)
def test_another_number_than_that_of_the_file_is_found(name: str) -> None:
    """A fault of a unit, a formula, an order or a digit in one part names its field."""
    scene, section, change = FAULTS[name]
    (element,) = load_scene(scene).elements
    assert isinstance(element, MechanismElement)
    assert misread(scene, element.mechanism)[0] == []
    first, *others = getattr(element.mechanism, section)
    changed = replace(element.mechanism, **{section: (change(first), *others)})
    assert len(misread(scene, changed)[0]) == 1
