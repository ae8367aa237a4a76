"""Balls that move rightly and are reported wrongly."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll_drill.mutants.base import STEP, Mutant, OneStepBehind


class ToldBall(Mutant):
    """Base of mutants with wrong samples of a ball."""

    asks = ("orientation",)

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.body = rolling_ball(scene)

    def local(self, p: FloatArray) -> FloatArray:
        """The surface's axes at a point."""
        return np.asarray(self.body.surface.frame(self.body.surface.locate(p[None]))[0])


class BodySpin(ToldBall):
    """ω along the body's axes."""

    fault = "body spin for world spin"
    named = ("angular velocity in body axes",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Turned back."""
        assert sample.q_WB is not None  # it is asked for
        turn = Rotation.from_quat(sample.q_WB, scalar_first=True)
        return dataclasses.replace(sample, w_WB=turn.inv().apply(sample.w_WB))


class LocalSpin(ToldBall):
    """ω along e1, e2, e3."""

    fault = "spin along the surface's axes"
    named = ("angular velocity in the surface's axes",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Its components."""
        return dataclasses.replace(sample, w_WB=self.local(sample.p_WB).T @ sample.w_WB)


class NegativeForce(ToldBall):
    """The force on the wall."""

    fault = "force of the ball on the wall"
    named = ("wrong sign",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Minus."""
        assert sample.force is not None
        return dataclasses.replace(sample, force=-sample.force)


class LocalForce(ToldBall):
    """The force along e1, e2, e3."""

    fault = "force in the surface's axes"
    named = ("ball in the surface's axes",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Its components, but at time 0."""
        assert sample.force is not None
        return dataclasses.replace(sample, force=self.local(sample.p_WB).T @ sample.force)


class BodyForce(ToldBall):
    """The force along the body's axes."""

    fault = "force in body axes"
    named = ("ball in body axes",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Turned back."""
        assert sample.force is not None
        assert sample.q_WB is not None
        turn = Rotation.from_quat(sample.q_WB, scalar_first=True)
        return dataclasses.replace(sample, force=turn.inv().apply(sample.force))


class FrictionSign(ToldBall):
    """N is right, the friction points the other way."""

    fault = "friction with the wrong sign"
    named = ("friction has the wrong sign",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Mirrored at the normal."""
        assert sample.force is not None
        e1 = self.local(sample.p_WB)[:, 0]
        return dataclasses.replace(sample, force=2 * (sample.force @ e1) * e1 - sample.force)


class StaleAxes(ToldBall):
    """The force is put along the axes of the step before."""

    fault = "stale normal: the force along the axes of a step before"
    named = ("normal of",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Turned by what the normal turns in a step."""
        assert sample.force is not None
        before = sample.p_WB - (STEP if self.t else 0.0) * sample.v_WB
        return dataclasses.replace(sample, force=self.local(before) @ self.local(sample.p_WB).T @ sample.force)


class Impulse(ToldBall):
    """The solver's impulse over the wrong step."""

    fault = "impulse instead of force"
    named = ("force is the wall's force on the ball",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Times a step."""
        assert sample.force is not None
        return dataclasses.replace(sample, force=sample.force * STEP)


class Clamped(ToldBall):
    """No component of the spin is beyond 60 rad/s: two of three get there, one of them by another way at each time."""

    fault = "spin clamped at 60 rad/s"
    named = ("clamped",)

    def misreport(self, sample: BallSample) -> BallSample:
        """After the first step."""
        return dataclasses.replace(sample, w_WB=np.clip(sample.w_WB, -60, 60) if self.t else sample.w_WB)


class Single(ToldBall):
    """All numbers are cut to 24 bits."""

    fault = "float32"
    named = ("single-precision",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Rounded."""
        cut = {name: np.float64(np.float32(getattr(sample, name))) for name in ("p_WB", "v_WB", "w_WB", "force")}
        return dataclasses.replace(sample, **cut)  # type: ignore[arg-type]  # vectors by name


class Late(ToldBall):
    """A state of a step before."""

    fault = "one step of lag"
    named = ("one step (0.002 s) late",)

    def clock(self, t: float) -> float:
        """Behind."""
        return t - STEP


class OneTooMany(ToldBall):
    """A step more than asked for at the first call."""

    fault = "one step too many"
    named = ("one step (0.002 s) early",)

    def clock(self, t: float) -> float:
        """Ahead."""
        return t + STEP


class Shifted(ToldBall):
    """Its clock begins at 4 ms."""

    fault = "time grid shifted by 4 ms"
    named = ("two steps (0.004 s) early",)

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.inner.advance(0.004)

    def clock(self, t: float) -> float:
        """Ahead."""
        return t + 0.004


class LateForce(OneStepBehind, ToldBall):
    """The state is of now, the force of the step before."""

    fault = "force of the step before"
    named = ("force is one step (0.002 s) late",)

    def misreport(self, sample: BallSample) -> BallSample:
        """The other's force."""
        return dataclasses.replace(sample, force=self.behind.sample().force)


class ContactPoint(ToldBall):
    """The contact point's place."""

    fault = "position of the contact point"
    named = ("contact point",)

    def misreport(self, sample: BallSample) -> BallSample:
        """One radius out, from the first step on."""
        out = self.body.ball.radius * self.local(sample.p_WB)[:, 0] if self.t else 0.0
        return dataclasses.replace(sample, p_WB=sample.p_WB + out)


class BallScalarLast(ToldBall):
    """Another convention for quaternions."""

    fault = "quaternion with its scalar last"
    named = ("scalar last",)

    def misreport(self, sample: BallSample) -> BallSample:
        """x, y, z, w."""
        assert sample.q_WB is not None
        return dataclasses.replace(sample, q_WB=np.roll(sample.q_WB, -1))


class Inverse(ToldBall):
    """The world in the body."""

    fault = "quaternion of the inverse rotation"
    named = ("inverse rotation",)

    def misreport(self, sample: BallSample) -> BallSample:
        """Conjugated."""
        assert sample.q_WB is not None
        return dataclasses.replace(sample, q_WB=sample.q_WB * [1, -1, -1, -1])
