"""Which integrator a bounded friction needs."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from proofroll.core.arrays import FloatArray
from proofroll.core.events import Event
from proofroll.elements.ball_on_surface.model import Contact
from proofroll.engines.pinocchio.integrators import TangentIntegrator
from proofroll.engines.pinocchio.mechanism import BallWithRows
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.stick_slip import AdaptiveStickSlip
from proofroll.engines.pinocchio.stick_slip_steps import StickSlipEuler, StickSlipRungeKutta4


@runtime_checkable
class StickSlipIntegrator(TangentIntegrator, Protocol):
    """An integrator that knows stick from slip.

    Attributes:
        events: so far.
        mu_static: largest |F|/N while sticking [-].
    """

    events: list[Event]
    mu_static: float

    @property
    def sticking(self) -> bool:
        """Whether the ball sticks now."""

    def reaction(self, data: Any) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration, and force of the wall on the ball in the world [N], now."""


def stick_slip(mechanism: BallWithRows, settings: PinocchioSettings, contact: Contact) -> StickSlipIntegrator:
    """The integrator that the settings ask for."""
    if settings.integrator == "dop853":
        return AdaptiveStickSlip(mechanism, settings, contact)
    if settings.integrator == "semi_implicit_euler":
        return StickSlipEuler(mechanism, settings, contact)
    return StickSlipRungeKutta4(mechanism, settings, contact)
