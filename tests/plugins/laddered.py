"""An engine with models of the ladder: reduced equations, with needed, useless, harmful and refused terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from tiny import Tiny, TinySettings

from proofroll.core.engine import whole_steps
from proofroll.core.engine_abilities import Level, Term
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody
from proofroll.papers.blajer_2006.ball.model import ROLLS

# Time at which the wind starts [s].
_CALM = 0.01


@dataclass(frozen=True)
class LadderedSettings(TinySettings):
    """Settings: a step, and switches of the model's terms."""

    formulation: Literal["midpoint", "heavier"] = "midpoint"  # type: ignore[assignment]  # more than Tiny has
    second_stage: bool = True
    idle: bool = False
    wind: Literal["none", "gale", "storm"] = "none"


class Laddered(Tiny):
    """Rolling ball by the midpoint rule, with switchable terms."""

    name: ClassVar[str] = "laddered"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"midpoint": ROLLS, "heavier": ROLLS}
    settings: ClassVar[type[Any]] = LadderedSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "midpoint": {"matched": LadderedSettings()},
        "heavier": {"matched": LadderedSettings("heavier", idle=True)},
    }
    levels: ClassVar[Mapping[str, Level]] = {"midpoint": Level.REDUCED, "heavier": Level.CONTACT}
    terms: ClassVar[Sequence[Term]] = (
        Term("second stage", ("midpoint",), {"second_stage": True}, {"second_stage": False}, "of second order"),
        Term("idle work", ("midpoint",), {"idle": True}, {"idle": False}, "keeps warm"),
        Term("gale", ("heavier",), {"wind": "gale"}, {"wind": "none"}, "blows", rung=True),
        Term("storm", ("heavier",), {"wind": "storm"}, {"wind": "none"}, "blows it over", rung=True),
    )
    inherent: ClassVar[Mapping[str, Mapping[str, str]]] = {"heavier": {MechanismCapability.ORIENTATION: "so it is"}}

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> RunOnBody:
        """See :class:`proofroll.core.engine.Engine`; refuses a storm."""
        if settings.wind == "storm":
            raise Refused("no ball rolls in a storm")
        return super().build(scene, settings)

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.chosen = settings

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for step in range(whole_steps(self.t, t, self.dt)):
            stage = self.x + self.dt / 2 * self.rates(self.x) if self.chosen.second_stage else self.x
            for _ in range(5 if self.chosen.idle else 1):
                rates = self.rates(stage)
            # An upward acceleration of 1 m/s²; from the start, it would show in the first steps
            if self.chosen.wind == "gale" and self.t + step * self.dt > _CALM:
                rates[3] += 1.0
            self.x = self.x + self.dt * rates
        self.t = t
