"""Loops around an engine with one mistake each in the bookkeeping of a controller."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

from proofroll.core.controlled_engine import commanded
from proofroll.core.engine import fixed_step
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.control import Control
from proofroll.elements.mechanism.scene.policy import Observation, PolicySource
from proofroll.robots.probe import make
from proofroll_drill.mutants.base import planted
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


def _upside_down(joints: Sequence[str]) -> Callable[[Observation], Any]:
    policy = make(joints)
    return lambda seen: policy(dataclasses.replace(seen, gravity_B=-seen.gravity_B))


def _controller(**fields: Callable[[Any, Control], Any]) -> Callable[[Any, Mechanism], Mechanism]:
    """Method ``other`` of a mutant: fields of the controller, each from the mutant and the right controller."""

    def other(self: Any, mechanism: Mechanism) -> Mechanism:
        right = mechanism.control
        assert right is not None
        control = dataclasses.replace(right, **{name: value(self, right) for name, value in fields.items()})
        return dataclasses.replace(mechanism, control=control)

    return other


_fault = partial(planted, ControlMutant)
FAULTS = (
    _fault("InstantLate", "targets an instant late", "one instant late", other=_controller(delay=lambda *_: 1)),
    # the first is right
    _fault(
        "LongPeriod",
        "one step more between instants",
        "one step longer",
        other=_controller(rate=lambda self, right: 1 / (1 / right.rate + self.step)),
    ),
    _fault(
        "ScaleOfActions",
        "scale of actions",
        "scale of actions is 0.8",
        other=_controller(scale=lambda _, right: 0.8 * right.scale),
    ),
    _fault(
        "SignOfGravity",
        "sign of the observed gravity",
        "observed gravity",
        other=_controller(policy=lambda *_: PolicySource("upside_down", make=_upside_down)),
    ),
)
