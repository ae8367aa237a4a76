"""Hypotheses on the structure of an engine's model."""

from __future__ import annotations

from typing import Any

from proofroll.core.diagnosis import Evidence
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.diagnosis.structure import axis_of_first_steps
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.signal import Formula


def test_a_driven_joint_that_begins_away_from_zero_has_no_other_axis() -> None:
    """An axis is tried in the scene's pose as coordinate zero, which a motion that begins elsewhere excludes."""
    hinge = Joint("hinge", "revolute", "world", "arm", motion=Formula("-0.8 + 2*t*t"))
    arm = Body("arm", 1.0, (0.3, 0.0, 0.1), ((0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.2)))
    line: dict[str, Any] = {"quantity": f"angular acceleration{OF_FIRST_STEPS}", "unit": "rad/s^2", "holds": False}
    line |= {"found": (0.0, 1.0, 3.0), "expected": (0.0, 0.0, 4.0), "difference": 0.25, "tolerance": 1e-3}
    element = MechanismElement(Mechanism((arm,), (hinge,), gravity=(0.0, 0.0, 0.0)))
    assert list(axis_of_first_steps.test(Evidence(element, [line]))) == []
