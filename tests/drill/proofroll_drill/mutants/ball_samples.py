"""Balls that move rightly and are reported wrongly."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll_drill.mutants.base import STEP, Mutant, planted


class ToldBall(Mutant):
    """Base of mutants with wrong samples of a ball."""

    asks = ("orientation",)

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.body = rolling_ball(scene)

    def local(self, p: FloatArray) -> FloatArray:
        """The surface's axes at a point."""
        return np.asarray(self.body.surface.frame(self.body.surface.locate(p[None]))[0])


def _told(name: str, fault: str, named: str, **said: Any) -> type[Mutant]:
    """Mutant whose samples have other fields, each from the mutant and its right sample."""

    def misreport(self: Any, sample: BallSample) -> BallSample:
        return dataclasses.replace(sample, **{field: value(self, sample) for field, value in said.items()})

    return planted(ToldBall, name, fault, named, misreport=misreport)


def _mirrored(self: Any, sample: Any) -> FloatArray:
    """Force mirrored at the normal."""
    e1 = self.local(sample.p_WB)[:, 0]
    return np.asarray(2 * (sample.force @ e1) * e1 - sample.force)


def _along_stale_axes(self: Any, sample: Any) -> FloatArray:
    """Force turned by what the normal turns in a step."""
    before = sample.p_WB - (STEP if self.t else 0.0) * sample.v_WB
    return np.asarray(self.local(before) @ self.local(sample.p_WB).T @ sample.force)


def _contact_point(self: Any, sample: BallSample) -> FloatArray:
    """Point one radius out, from the first step on."""
    return sample.p_WB + (self.body.ball.radius * self.local(sample.p_WB)[:, 0] if self.t else 0.0)


def _single(_: Any, sample: BallSample) -> BallSample:
    """Sample whose numbers are cut to 24 bits."""
    cut = {name: np.float64(np.float32(getattr(sample, name))) for name in ("p_WB", "v_WB", "w_WB", "force")}
    return dataclasses.replace(sample, **cut)  # type: ignore[arg-type]  # vectors by name


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


_ball = partial(planted, ToldBall)
FAULTS = (
    _told(
        "LocalSpin",
        "spin along the surface's axes",
        "angular velocity in the surface's axes",
        w_WB=lambda self, sample: self.local(sample.p_WB).T @ sample.w_WB,
    ),
    # two of three components of the spin get there, one of them by another way at each time
    _told(
        "Clamped",
        "spin clamped at 60 rad/s",
        "clamped",
        w_WB=lambda self, sample: np.clip(sample.w_WB, -60, 60) if self.t else sample.w_WB,
    ),
    _told(
        "LocalForce",
        "force in the surface's axes",
        "contact on its first body in the surface's axes",
        force=lambda self, sample: self.local(sample.p_WB).T @ sample.force,
    ),
    _told("FrictionSign", "friction with the wrong sign", "friction has the wrong sign", force=_mirrored),
    _told("StaleAxes", "stale normal: the force along the axes of a step before", "normal of", force=_along_stale_axes),
    _told(
        "Impulse",
        "impulse instead of force",
        "times the step, as an impulse",
        force=lambda _, sample: sample.force * STEP,
    ),
    _told("ContactPoint", "position of the contact point", "contact point", p_WB=_contact_point),
    _told(
        "Inverse",
        "quaternion of the inverse rotation",
        "inverse rotation",
        q_WB=lambda _, sample: sample.q_WB * [1, -1, -1, -1],
    ),
    _ball("Single", "float32", "single-precision", misreport=_single),
    _ball("OneTooMany", "one step too many", "one step (0.002 s) early", clock=lambda _, t: t + STEP),
    Shifted,
)
