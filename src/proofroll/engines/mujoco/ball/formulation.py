"""Base of the three ways to present a wall to MuJoCo."""

from abc import ABC, abstractmethod
from typing import Any

from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.mujoco.ball.contact import Resistance
from proofroll.engines.mujoco.settings import MujocoSettings


class Formulation(ABC):
    """One way to present the wall to MuJoCo, and to step the model.

    Attributes:
        resistance: the torque of rolling resistance that its steps apply.
    """

    def __init__(self, model: Any, body: RollingBall, settings: MujocoSettings) -> None:  # noqa: ARG002 -- of subclasses
        self._model = model
        self._surface, self._ball = body.surface, model.body("ball").id
        self.resistance = Resistance(body.contact.rolling_resistance)

    @staticmethod
    @abstractmethod
    def write(spec: Any, body: RollingBall) -> None:
        """Sets the numbers of the wall and of the joints. Raises Refused if the model's file does not suit them."""

    @property
    def resists(self) -> bool:
        """True if the steps apply the torque of rolling resistance."""
        return self.resistance.f > 0

    @abstractmethod
    def run(self, data: Any, steps: int) -> None:
        """Makes ``steps`` steps."""

    @abstractmethod
    def evaluate(self, data: Any) -> None:
        """Computes forces and accelerations of the present state, as a step would."""
