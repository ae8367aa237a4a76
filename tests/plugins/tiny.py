"""The smallest engine that keeps every promise of the protocol: the midpoint rule on the reduced equations."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from annotated_types import Gt
from placed_balls import placed

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import initial_response
from proofroll.papers.blajer_2006.ball.model import ROLLS
from proofroll.papers.blajer_2006.ball.rolling_equations import reduced_rates
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample


@dataclass(frozen=True)
class TinySettings:
    """A step and nothing else."""

    formulation: Literal["midpoint"] = "midpoint"
    preset: Literal["matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3

    @property
    def resolution(self) -> str:
        """See :class:`proofroll.core.engine.Settings`."""
        return "dt"

    @property
    def order(self) -> int | None:
        """See :class:`proofroll.core.engine.Settings`."""
        return 2


class Tiny:
    """The midpoint rule, of second order, on (u, u̇, ω1)."""

    name: ClassVar[str] = "tiny"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"midpoint": ROLLS}
    settings: ClassVar[type[Any]] = TinySettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"matched": TinySettings()}}

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "1.0"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> RunOnBody:
        """See :class:`proofroll.core.engine.Engine`."""
        return on_body(cls(scene, settings), scene)

    def __init__(self, scene: Scene, settings: Any) -> None:
        self.body, self.dt, self.t = rolling_ball(scene), settings.dt, 0.0
        self.resists = self.body.contact.rolling_resistance > 0
        self.x = np.array([*self.body.u0, *self.body.udot0, placed(scene).start.spin])

    def rates(self, x: FloatArray) -> FloatArray:
        """Rates ẋ of the state x = (u, u̇, ω1)."""
        return reduced_rates(self.body, x)[0]

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for _ in range(whole_steps(self.t, t, self.dt)):
            self.x = self.x + self.dt * self.rates(self.x + self.dt / 2 * self.rates(self.x))
        self.t = t

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        _, v, force = reduced_rates(self.body, self.x)
        e1 = self.body.surface.frame(self.x[:2])[:, 0]
        w = self.x[4] * e1 - np.cross(e1, v) / self.body.ball.radius
        return BallSample(self.body.surface.position(self.x[:2]), v, w, force=force)

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        ball = self.body.ball
        return BallBuilt(
            mass=ball.mass,
            inertia=np.full(3, ball.inertia),
            gravity=self.body.gravity,
            ball_radius=ball.radius,
            rolling_resistance=self.body.contact.rolling_resistance,
            acceleration=initial_response(self.body)[0],
            terms=frozenset({MechanismCapability.TURNING_FRICTION} if self.resists else ()),
        )


class Sleepy(Tiny):
    """Needs one second of wall time for each simulated second."""

    name: ClassVar[str] = "sleepy"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        time.sleep(max(t - self.t, 0.0))
        super().advance(t)


class Grown(Tiny):
    """An engine whose adapter supports no version before 2.5."""

    name: ClassVar[str] = "grown"
    oldest: ClassVar[str] = "2.5"

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "3.0"
