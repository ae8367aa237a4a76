"""The least model behind proofroll's engine protocol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, Self

import numpy as np

import proofroll
from proofroll.core.arrays import FloatArray, cross
from proofroll.core.engine import Built, Sample
from proofroll.core.engine_abilities import Level, Term
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.compiled.library import with_heyoka
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import ROLLS, BallCapability, RollingBall
from proofroll.engines.reduced.models import ClosedFormModel, Compiled, Integrated, ReducedModel
from proofroll.engines.reduced.settings import PRESETS, ReducedSettings


class Reduced:
    """The scene's least model: a closed form, or five equations of motion with no constraint left.

    It shares the closed form and the equations with the truth's first route (:mod:`rolling_equations`), so agreement
    with the truth is news only as far as the truth's second route, which shares neither, agrees too.
    """

    name: ClassVar[str] = "reduced"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "equations": ROLLS | {BallCapability.MOVING_WALL},
        "closed_form": (ROLLS | {BallCapability.MOVING_WALL}) - {BallCapability.ROLLING_RESISTANCE},
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "closed_form": {
            BallCapability.ROLLING_RESISTANCE: "there is no closed form with rolling resistance; "
            "take formulation=equations"
        }
    }
    settings: ClassVar[type[ReducedSettings]] = ReducedSettings
    presets: ClassVar[Mapping[str, Mapping[str, ReducedSettings]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {"equations": Level.REDUCED, "closed_form": Level.CLOSED_FORM}
    shares: ClassVar[Mapping[str, Sequence[str]]] = {
        "equations": (
            "reduced equations",
            "surface coordinates with direction of slip",
            "local frame with direction of slip",
        ),
        "closed_form": ("closed form",),
    }
    terms: ClassVar[Sequence[Term]] = ()  # the least model has nothing left to switch off

    @staticmethod
    def version() -> str:
        """The equations are part of proofroll; heyoka integrates them where it is installed."""
        return with_heyoka(proofroll.__version__)

    @classmethod
    def build(cls, scene: Scene, settings: ReducedSettings) -> Self:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(rolling_ball(scene), settings)

    def __init__(self, body: RollingBall, settings: ReducedSettings) -> None:
        self._body = body
        self._model: ReducedModel
        if settings.rtol is None:
            self._model = ClosedFormModel(body)
        elif settings.integrator == "taylor":
            self._model = Compiled(body, settings.rtol)
        else:
            self._model = Integrated(body, settings.rtol)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self._model.advance(t)

    def sample(self) -> Sample:
        """See :class:`proofroll.core.engine.Engine`. The orientation is not followed: nothing needs it."""
        motion = self._model.motion()
        return Sample(
            p_WB=motion.p_WB[0].copy(),
            v_WB=motion.v_WB[0].copy(),
            w_WB=motion.w_WB[0].copy(),
            force=motion.force[0].copy(),
        )

    def built(self) -> Built:
        """See :class:`proofroll.core.engine.Engine`."""
        body, motion = self._body, self._model.motion()
        ball, f = body.ball, body.contact.rolling_resistance
        acceleration = motion.force[0] / ball.mass + body.gravity
        return Built(
            mass=ball.mass,
            inertia=np.full(3, ball.inertia),
            gravity=body.gravity.copy(),
            ball_radius=ball.radius,
            rolling_resistance=f,
            acceleration=acceleration,
            angular_acceleration=self._turning(motion.p_WB[0], motion.v_WB[0], motion.w_WB[0], acceleration),
            terms=frozenset({BallCapability.ROLLING_RESISTANCE} if f else ()),
        )

    def _turning(self, p: FloatArray, v: FloatArray, w: FloatArray, acceleration: FloatArray) -> FloatArray | None:
        """ω̇ [rad/s²], shape (3,): rate of ω = ω1 e1 - e1 × v / a."""
        spin_rate, surface = self._model.spin_rate(), self._body.surface
        if spin_rate is None:
            return None
        e1 = surface.normal(p)
        e1_rate, v0 = surface.normal_gradient(p) @ v, v
        if (W := self._body.wall_rate) is not None:  # the ball rolls on what the wall does not carry along
            v = v - cross(W, p + self._body.ball.radius * e1)
            acceleration = acceleration - cross(W, v0 + self._body.ball.radius * e1_rate)
        swung = cross(e1_rate, v) + cross(e1, acceleration)
        return np.asarray(spin_rate * e1 + (w @ e1) * e1_rate - swung / self._body.ball.radius)
