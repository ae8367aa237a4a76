"""Hypotheses that the numbers of a kind, of all bodies, joints or springs, have one factor in the engine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.diagnosis import Cause, Evidence
from proofroll.core.diagnosis.fitting import said_factor, telling
from proofroll.elements.mechanism.diagnosis.equations import Change
from proofroll.elements.mechanism.diagnosis.held import best, held_against
from proofroll.elements.mechanism.model import Mechanism


@dataclass(frozen=True)
class Factor:
    """A number of all bodies or joints times a factor.

    Attributes:
        id: of the hypothesis.
        what: the number, in words.
        change: the mechanism with a factor on it.
        has: whether the mechanism has such numbers.
        remedy: what to look at.
    """

    id: str
    what: str
    change: Callable[[Mechanism, float], Change]
    has: Callable[[Mechanism], bool]
    remedy: str
    grounds: str = "the equations of motion are linear in it: one factor balances them at every state of the run"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        if not self.has(mechanism):
            return
        for held in held_against(evidence):
            factor, number = best(held, lambda x: self.change(mechanism, x))
            if not telling(factor):
                continue
            says = f"the engine moves it with {self.what} {said_factor(factor)}"
            yield held.cause(self.id, says, self.change(mechanism, factor), self.remedy, number)


def _inertias(mechanism: Mechanism, x: float) -> Change:
    return Change(mechanism, inertia=x * np.array([body.inertia for body in mechanism.bodies]))


def _masses(mechanism: Mechanism, x: float) -> Change:
    return Change(mechanism, mass=x * np.array([body.mass for body in mechanism.bodies]))


FACTORS_OF_ALL: tuple[Any, ...] = (
    Factor(
        "gravity",
        "gravity",
        lambda m, x: Change(m, gravity=x * np.array(m.gravity)),
        lambda m: any(m.gravity),
        "give the engine the scene's gravity: an acceleration in the world, its sign and its unit",
    ),
    Factor("mass", "all masses", _masses, lambda m: bool(m.bodies), "give each body its mass once"),
    Factor("inertia", "all inertias", _inertias, lambda m: bool(m.bodies), "give each body its inertia once"),
    Factor(
        "joint damping",
        "the damping of the joints",
        lambda m, x: Change(m, damping=x),
        lambda m: any(joint.damping for joint in m.joints),
        "give the joints their damping, as a moment per rad/s or a force per m/s against the motion",
    ),
    Factor(
        "joint stiffness",
        "the stiffness of the joints",
        lambda m, x: Change(m, stiffness=x),
        lambda m: any(joint.stiffness for joint in m.joints),
        "give the joints their stiffness, per rad or per m",
    ),
    Factor(
        "joint torque",
        "the drives of the joints",
        lambda m, x: Change(m, torque=x),
        lambda m: any(joint.torque for joint in m.joints),
        "give the joints their drive, on the child against the parent",
    ),
    Factor(
        "armature",
        "the armature of the joints",
        lambda m, x: Change(m, armature=x),
        lambda m: any(joint.armature for joint in m.joints),
        "give the joints their armature",
    ),
    Factor(
        "springs",
        "the stiffness of the springs",
        lambda m, x: Change(m, springs=x),
        lambda m: bool(m.springs),
        "give the springs their stiffness and free length",
    ),
    Factor(
        "damping of springs",
        "the damping of the springs",
        lambda m, x: Change(m, spring_damping=x),
        lambda m: any(spring.damping for spring in m.springs),
        "give the springs their damping, along the line between their ends",
    ),
    Factor(
        "springs with damping",
        "the springs",
        lambda m, x: Change(m, springs=x, spring_damping=x),
        lambda m: any(spring.damping for spring in m.springs),
        "give the springs their stiffness, damping and free length",
    ),
    Factor(
        "gyroscopic terms",
        "the gyroscopic moments w x I w",
        lambda m, x: Change(m, gyroscopic=x),
        lambda m: bool(m.bodies),
        "the rate of the angular momentum has the term w x I w",
    ),
)
