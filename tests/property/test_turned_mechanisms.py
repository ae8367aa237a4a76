"""A mechanism in a world whose axes are turned and whose origin lies elsewhere is the same mechanism."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from turned_scenes import turned_scene

from proofroll.core.certificate import certify, first_difference
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build

# The first formulations of each engine that close loops, then those that contacts or trees need.
OF_LOOPS = [
    ("exudyn", "redundant"),
    ("mujoco", "joints"),
    ("pinocchio", "null_space"),
    ("pinocchio", "constraint_dynamics"),
    ("projection", "dependent"),
]
OTHERS = [("exudyn", "tree"), ("mujoco", "geoms"), ("exudyn", "spheres"), ("pinocchio", "impulses")]


def _mechanisms() -> dict[str, bool]:
    """Names of the scenes of one mechanism, and whether each has loops."""
    elements = {
        path.parent.name: load_scene(path.parent.name).elements for path in data_folder("models").glob("*/scene.toml")
    }
    return {
        name: bool(only[0].mechanism.loops)
        for name, only in sorted(elements.items())
        if len(only) == 1 and isinstance(only[0], MechanismElement)
    }


SCENES = _mechanisms()
# Each formulation builds every second scene with loops; of other scenes it builds every eighth. Every third of these
# cases runs before a change lands.
_ALL = [
    (scene, *formulation)
    for index, (scene, number) in enumerate(product(SCENES, range(len(OF_LOOPS + OTHERS))))
    for formulation in [(OF_LOOPS + OTHERS)[number]]
    if formulation in (OF_LOOPS if SCENES[scene] else OF_LOOPS + OTHERS) and index % (2 if SCENES[scene] else 8) == 0
]
CASES = [pytest.param(*case, marks=pytest.mark.nightly if place % 3 else ()) for place, case in enumerate(_ALL)]


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize(("name", "engine", "formulation"), CASES)
def test_a_turned_mechanism_has_the_same_certificate(name: str, engine: str, formulation: str) -> None:
    """An engine builds a turned and shifted scene as well as the scene itself, or refuses both."""
    scene = load_scene(name)
    random = np.random.default_rng(_ALL.index((name, engine, formulation)))
    turns = [(math.pi / 2, 0.0, 0.4), tuple(random.uniform(-3.0, 3.0, 3))]
    answers = []
    for case in [scene, *(turned_scene(scene, rpy, tuple(random.uniform(-2.0, 2.0, 3))) for rpy in turns)]:
        try:
            answers.append(first_difference(certify(build(case, engine, formulation=formulation), case)))
        except (Refused, Diverged) as refusal:  # a law of contact may have no answer at the start
            answers.append(str(refusal).partition("; choose")[0])  # who could build it instead
    assert answers[1:] == answers[:1] * 2
