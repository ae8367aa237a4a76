"""Loops around an engine with one mistake each in the bookkeeping of a controller."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from proofroll.core.controlled_engine import commanded
from proofroll.core.engine import fixed_step
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.control import Control
from proofroll.elements.mechanism.scene.policy import Observation, PolicySource
from proofroll.robots.probe import make
from proofroll_drill.mutants.mechanism_models import MechanismMutant


class ControlMutant(MechanismMutant):
    """Program with an engine in a loop of its own: its controller sets the targets, not the harness."""

    scene: ClassVar[Any] = ("leg_in_the_air", {})
    until: ClassVar[float] = 0.1
    every: ClassVar[float] = 0.004
    step: ClassVar[float] = 1e-3

    def __init__(self, scene: Any, settings: Any) -> None:
        super().__init__(scene, settings)
        (element,) = self.misread(scene).elements
        self.inner = commanded(self.inner, element, fixed_step(settings))

    def drive(self, values: Any) -> None:
        """Targets of the harness, which its own replace."""

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism with another controller."""
        assert mechanism.control is not None
        return dataclasses.replace(mechanism, control=self.control(mechanism.control))

    def control(self, control: Control) -> Control:
        """Controller that it runs."""
        return control


class InstantLate(ControlMutant):
    """Sets targets one instant late."""

    fault = "targets an instant late"
    named = ("one instant late",)

    def control(self, control: Control) -> Control:
        """Controller of one instant more."""
        return dataclasses.replace(control, delay=1)


class LongPeriod(ControlMutant):
    """Leaves a step more between instants; the first is right."""

    fault = "one step more between instants"
    named = ("one step longer",)

    def control(self, control: Control) -> Control:
        """Controller of a lower rate."""
        return dataclasses.replace(control, rate=1 / (1 / control.rate + self.step))


class ScaleOfActions(ControlMutant):
    """Takes 0.8 of the scale of actions."""

    fault = "scale of actions"
    named = ("scale of actions is 0.8",)

    def control(self, control: Control) -> Control:
        """Controller of a smaller scale."""
        return dataclasses.replace(control, scale=0.8 * control.scale)


class SignOfGravity(ControlMutant):
    """Policy that sees gravity with the other sign."""

    fault = "sign of the observed gravity"
    named = ("observed gravity",)

    def control(self, control: Control) -> Control:
        """Policy behind a wrong observation."""
        return dataclasses.replace(control, policy=PolicySource("upside_down", make=_upside_down))


def _upside_down(joints: Sequence[str]) -> Callable[[Observation], Any]:
    policy = make(joints)
    return lambda seen: policy(dataclasses.replace(seen, gravity_B=-seen.gravity_B))
