"""Balls with another start, contact or clock than the scene's."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.mechanics import newton_euler
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll_drill.mutants.ball_models import RESISTED, NewtonMutant
from proofroll_drill.mutants.base import OneStepBehind


class NoSpin(NewtonMutant):
    """Positions and velocities are set at the start, the spin is not."""

    fault = "initial spin forgotten"
    named = ("angular velocity left out", "spin left out")

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.x[2] = 0.0


class ResistedByWeight(NewtonMutant):
    """The moment is f m g, whatever the wall presses."""

    fault = "rolling resistance by the weight instead of N"
    scene = RESISTED
    named = ("weight",)

    def response(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Response with the f that gives this moment."""
        contact, weight = self.body.contact, self.body.ball.mass * float(np.linalg.norm(self.body.gravity))
        f = contact.rolling_resistance
        for _ in range(20):
            N = -float(newton_euler(self.resisted(f), *x)[2] @ self.body.surface.normal(x[0]))
            f = contact.rolling_resistance * weight / N
        return newton_euler(self.resisted(f), *x)

    def resisted(self, f: float) -> Any:
        """The ball with another f."""
        contact = dataclasses.replace(self.body.contact, rolling_resistance=f)
        return dataclasses.replace(self.body, contact=contact)


class MeanForce(OneStepBehind):
    """The force is the mean of the step's impulse, as a solver of impulses has it."""

    fault = "force averaged over the last step"
    named = ("half a step",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Mean force by the trapezoidal rule."""
        before = self.behind.sample().force
        assert before is not None
        assert sample.force is not None
        return dataclasses.replace(sample, force=(before + sample.force) / 2)


class FastClock(NewtonMutant):
    """A step of 1/480 s is counted as one of 2 ms."""

    fault = "time that runs 4 % too fast"
    named = ("time",)
    h = 1 / 480
