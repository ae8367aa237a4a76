"""An engine whose behaviour depends on its installed version: order, refusals, defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from typing import Any, ClassVar, Literal

from tiny import Tiny, TinySettings

from proofroll.core.engine import whole_steps
from proofroll.core.errors import Refused
from proofroll.core.plugins import release
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody
from proofroll.papers.blajer_2006.ball.model import ROLLS

DISTRIBUTION = "aged"


def age() -> tuple[int, ...]:
    """Installed version of the engine."""
    return release(metadata.version(DISTRIBUTION))


@dataclass(frozen=True)
class AgedSettings(TinySettings):
    """Settings: a step, and one of two models."""

    formulation: Literal["midpoint", "walls"] = "midpoint"  # type: ignore[assignment]  # more than Tiny has

    @property
    def order(self) -> int:
        """Order of the method: 2 since version 2, before 1."""
        return 2 if age() >= (2,) else 1


class Aged(Tiny):
    """Rolling ball by the midpoint rule from version 2 on; before, by Euler's method and without walls."""

    name: ClassVar[str] = "aged"
    oldest: ClassVar[str] = "1.0"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"midpoint": ROLLS, "walls": ROLLS}
    settings: ClassVar[type[Any]] = AgedSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "midpoint": {"matched": AgedSettings()},
        "walls": {"matched": AgedSettings("walls")},
    }

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return metadata.version(DISTRIBUTION)

    @staticmethod
    def defaults() -> dict[str, Any]:
        """See :class:`proofroll.core.engine_abilities.TellsDefaults`."""
        return {"iterations": 100 if age() >= (2,) else 50, "gravity": -9.81}

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> RunOnBody:
        """See :class:`proofroll.core.engine.Engine`; refuses walls before version 2."""
        if settings.formulation == "walls" and age() < (2,):
            raise Refused("walls came with version 2")
        return super().build(scene, settings)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for _ in range(whole_steps(self.t, t, self.dt)):
            stage = self.x + self.dt / 2 * self.rates(self.x) if age() >= (2,) else self.x
            self.x = self.x + self.dt * self.rates(stage)
        self.t = t
