"""A complete engine in under 60 lines: Newton-Euler with rolling rows, stepped by semi-implicit Euler."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt

from proofroll import adapter


@dataclass(frozen=True)
class Settings:
    formulation: Literal["newton_euler"] = "newton_euler"
    preset: Literal["default"] = "default"
    dt: Annotated[float, Gt(0)] = 1e-4  # step [s]
    resolution = "dt"
    order = 1  # and, if it computes in float32, precision = "single"; nothing means double


class SemiImplicit:
    """Semi-implicit Euler on the unreduced equations."""

    name: ClassVar[str] = "semi_implicit"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"newton_euler": adapter.ROLLS}
    settings: ClassVar[type[Settings]] = Settings
    presets: ClassVar[Mapping[str, Mapping[str, Settings]]] = {"newton_euler": {"default": Settings()}}

    @staticmethod
    def version() -> str:
        return "1.0"

    @classmethod
    def build(cls, scene: adapter.Scene, settings: Settings) -> adapter.RunOnBody:
        return adapter.on_body(cls(adapter.rolling_ball(scene), settings.dt), scene)

    def __init__(self, body: adapter.RollingBall, dt: float) -> None:
        self.body, self.dt, self.t = body, dt, 0.0
        self.p, self.v, self.w = body.p0.copy(), body.v0.copy(), body.w0.copy()

    def advance(self, t: float) -> None:
        for _ in range(adapter.whole_steps(self.t, t, self.dt)):
            acceleration, spin_rate, _ = adapter.newton_euler(self.body, self.p, self.v, self.w)
            self.v, self.w = self.v + self.dt * acceleration, self.w + self.dt * spin_rate
            self.p = self.p + self.dt * self.v
        self.t = t

    def sample(self) -> adapter.BallSample:
        return adapter.BallSample(
            self.p, self.v, self.w, force=adapter.newton_euler(self.body, self.p, self.v, self.w)[2]
        )

    def built(self) -> adapter.BallBuilt:
        acceleration, *_ = adapter.newton_euler(self.body, self.p, self.v, self.w)
        return adapter.BallBuilt(rolling_resistance=self.body.contact.rolling_resistance, acceleration=acceleration)
