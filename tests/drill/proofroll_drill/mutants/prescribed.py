"""Mechanisms whose prescribed motions come late, backwards, or in degrees."""

from __future__ import annotations

from typing import Any, ClassVar

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.scene.signal import Formula, Signal, delayed
from proofroll_drill.mutants.base import STEP
from proofroll_drill.mutants.mechanism_models import MechanismMutant


class OfMotion(MechanismMutant):
    """Base of mutants of one prescribed motion; they start as the scene says."""

    scene: ClassVar[Any] = ("shaken_pendulum", {})

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        equations = self.inner._equations
        equations._moved = [(number, self.changed(signal)) for number, signal in equations._moved]

    def changed(self, motion: Signal) -> Signal:
        """Motion that it follows."""
        return motion


class Late(OfMotion):
    """The place of a step is that of the step before."""

    fault = "prescribed motion a step late"
    named = ("the motion of shaker is a step late",)

    def changed(self, motion: Signal) -> Signal:
        """Motion late by the step of the mutant."""
        return delayed(motion, STEP)


class Backwards(OfMotion):
    """The axis points the other way."""

    fault = "prescribed motion with the wrong sign"
    named = ("the motion of shaker has the opposite sign",)

    def changed(self, motion: Signal) -> Signal:
        """Motion against the axis."""
        assert isinstance(motion, Formula)  # that of the scene
        return Formula(f"-({motion.text})", motion.numbers)


class InDegrees(OfMotion):
    """The motion in radians is taken for degrees."""

    fault = "prescribed motion in degrees"
    scene: ClassVar[Any] = ("driven_four_bar", {})
    named = ("the motion of motor is taken for degrees",)

    def changed(self, motion: Signal) -> Signal:
        """Motion smaller by 180/pi."""
        assert isinstance(motion, Formula)  # that of the scene
        return Formula(f"({motion.text})*pi/180", motion.numbers)
