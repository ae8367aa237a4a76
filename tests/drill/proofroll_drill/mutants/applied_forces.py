"""Mechanisms whose applied forces act in other axes, at other places, late, or without their reaction."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from proofroll.elements.mechanism import Force, Mechanism
from proofroll.elements.mechanism.scene.signal import Formula, delayed
from proofroll_drill.mutants.base import STEP
from proofroll_drill.mutants.mechanism_models import MechanismMutant


class OfForce(MechanismMutant):
    """Base of mutants of one applied force.

    Attributes:
        force: its name.
    """

    scene: ClassVar[Any] = ("slung_load", {})
    force: ClassVar[str] = "thrust"

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism with that force changed."""
        forces = tuple(self.changed(one) if one.name == self.force else one for one in mechanism.forces)
        return dataclasses.replace(mechanism, forces=forces)

    def changed(self, force: Force) -> Force:
        """Force that it applies."""
        return force


class InWorldAxes(OfForce):
    """Components along the axes of the body are taken along those of the world."""

    fault = "applied force in the wrong frame"
    named = ("force thrust acts along the axes of the world, not of craft",)

    def changed(self, force: Force) -> Force:
        """Force along the axes of the world."""
        return dataclasses.replace(force, frame="world")


class AtCentre(OfForce):
    """The moment of the force about the centre of mass is lost."""

    fault = "applied force at the centre of mass"
    named = ("force wind acts at the centre of mass of load",)
    force = "wind"

    def changed(self, force: Force) -> Force:
        """Force at the centre of mass of the load."""
        return dataclasses.replace(force, position=(0, 0.02, -0.3))


class Mirrored(OfForce):
    """The place has the wrong sign."""

    fault = "applied force at its mirrored point"
    named = ("force thrust acts at the opposite place of craft",)

    def changed(self, force: Force) -> Force:
        """Force on the other side of the origin."""
        x, y, z = force.position
        return dataclasses.replace(force, position=(-x, -y, -z))


class Elsewhere(OfForce):
    """The place is another one, none that a hypothesis tries by name."""

    fault = "applied force at the wrong point"
    named = ("force wind acts along a line through (-0.0228, 0.127, -0.215) m of load",)
    force = "wind"

    def changed(self, force: Force) -> Force:
        """Force at another point of the load."""
        return dataclasses.replace(force, position=(0.05, 0.13, -0.2))


class Unopposed(OfForce):
    """The second body feels nothing."""

    fault = "applied moment without reaction"
    named = ("moment winch has no reaction on load",)
    force = "winch"

    def changed(self, force: Force) -> Force:
        """Moment on the first body alone."""
        return dataclasses.replace(force, reaction="world")


class Late(OfForce):
    """The force of a step is that of the step before."""

    fault = "applied force a step late"
    named = ("force thrust is a step late",)

    def changed(self, force: Force) -> Force:
        """Force late by the step of the mutant."""
        value: Any = tuple(delayed(part, STEP) for part in force.value)
        return dataclasses.replace(force, value=value)


class Weak(OfForce):
    """A tenth too little."""

    fault = "applied force 0.9 times"
    named = ("force thrust 0.9 times",)

    def changed(self, force: Force) -> Force:
        """Force with a tenth less, in formula and number."""
        (x, y, z) = force.value
        assert isinstance(z, Formula)  # that of the scene
        smaller = dataclasses.replace(z, text=f"0.9*({z.text})")
        return dataclasses.replace(force, value=(0.9 * x, 0.9 * y, smaller))  # type: ignore[operator]  # numbers
