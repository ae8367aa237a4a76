"""Causes that lie in the laws of joints: couplings that give way."""

from __future__ import annotations

import dataclasses

import pytest
from pulleys import massless_pulley, one_rope

from proofroll.core.certificate import certify
from proofroll.core.diagnosis import Cause, Evidence
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.diagnosis.joint_laws import soft_couplings
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build


def light_pulley() -> Mechanism:
    """Weights on a movable pulley of 0.1 kg."""
    mechanism = massless_pulley()
    bodies = (dataclasses.replace(body, mass=body.mass or 0.1, inertia=(1.0, 1.0, 1.0)) for body in mechanism.bodies)
    return dataclasses.replace(mechanism, bodies=tuple(bodies))


def causes(mechanism: Mechanism, engine: str, **settings: object) -> list[Cause]:
    """Proven causes of soft couplings in an engine's certificate."""
    scene = load_scene("gear_pair")
    scene = dataclasses.replace(scene, elements=(MechanismElement(mechanism),))
    lines = [line.as_dict() for line in certify(build(scene, engine, **settings), scene)]
    return [cause for cause in soft_couplings.test(Evidence(scene.elements[0], lines)) if cause.proven]


@pytest.mark.parametrize(
    ("mechanism", "whose"),
    [(light_pulley(), "the sum of its joints' inverse inertias"), (one_rope(), "its own inverse inertia")],
    ids=["equality of joints", "equality of a tendon"],
)
def test_softness_of_couplings_is_a_cause(mechanism: Mechanism, whose: str) -> None:
    """One softness explains all first accelerations of couplings of impedance 0.9, to round-off, and says of what."""
    (cause,) = causes(mechanism, "mujoco", preset="default")
    assert cause.accuses
    assert cause.after < 1e-9 * cause.before
    assert f"by 0.1111 times {whose}" in cause.says
    assert "their impedance is 0.9;" in cause.remedy


@pytest.mark.parametrize(("engine", "settings"), [("mujoco", {}), ("pinocchio", {"formulation": "null_space"})])
def test_couplings_that_hold_are_no_cause(engine: str, settings: dict[str, object]) -> None:
    """Couplings that are rigid, or as stiff as an impedance of 0.9999, accuse no engine."""
    assert not any(cause.accuses for cause in causes(light_pulley(), engine, **settings))
