"""Couplings of three joints, and joints whose inertia comes through couplings, in the engines that have them."""

from __future__ import annotations

import dataclasses

import pytest
from pulleys import MASSES, accelerations, massless_pulley, one_rope

from proofroll.core.certificate import certify, first_difference
from proofroll.elements.mechanism import Mechanism
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build


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
