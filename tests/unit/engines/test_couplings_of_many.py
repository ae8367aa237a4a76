"""Couplings of three joints, and joints whose inertia comes through couplings, in the engines that have them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pulleys import MASSES, accelerations, massless_pulley, one_rope

from proofroll.core.certificate import certify, first_difference
from proofroll.elements.mechanism import Mechanism
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("mechanism", "engine", "formulation", "close"),
    [
        (one_rope(), "mujoco", "joints", 1e-3),
        (one_rope(), "pinocchio", "null_space", 1e-12),
        (one_rope(), "projection", "dependent", 1e-12),
        (massless_pulley(), "pinocchio", "null_space", 1e-12),
    ],
    ids=["mujoco", "pinocchio", "projection", "pinocchio massless"],
)
def test_weights_on_pulleys(mechanism: Mechanism, engine: str, formulation: str, close: float) -> None:
    """The engine's model has the coupling, its weights fall as a textbook says, and its rope has the tension."""
    scene = load_scene("gear_pair")
    scene = dataclasses.replace(scene, elements=(dataclasses.replace(scene.elements[0], mechanism=mechanism),))
    built = build(scene, engine, formulation=formulation)
    assert first_difference(certify(built, scene)) is None
    built.advance(0.1)
    sample = built.sample()
    heights = [sample.p_WB[mechanism.body_index[f"w{k}"], 2] for k in range(3)]
    expected = accelerations()
    assert heights == pytest.approx([0.005 * a for a in expected], rel=close)
    assert sample.coupling[0] == pytest.approx(MASSES[0] * (expected[0] + 9.81), rel=close)


@pytest.mark.parametrize("engine", ["mujoco", "pinocchio", "projection"])
def test_a_sum_of_three_coordinates_has_its_place(engine: str) -> None:
    """A coupling of three joints holds their sum at its offset, which is not zero."""
    mechanism = one_rope()
    (rope,), (first, *others) = mechanism.couplings, mechanism.joints
    shifted = dataclasses.replace(mechanism, joints=(dataclasses.replace(first, q0=(0.15,)), *others))
    shifted = dataclasses.replace(shifted, couplings=(dataclasses.replace(rope, offset=0.3),))
    scene = load_scene("gear_pair")
    scene = dataclasses.replace(scene, elements=(dataclasses.replace(scene.elements[0], mechanism=shifted),))
    built = build(scene, engine)
    assert first_difference(certify(built, scene)) is None
    built.advance(0.1)
    expected = [0.15, 0.0, 0.0] + 0.005 * np.array(accelerations())
    heights = built.sample().p_WB[[shifted.body_index[f"w{k}"] for k in range(3)], 2]
    assert heights == pytest.approx(expected, rel=1e-3, abs=1e-5)
