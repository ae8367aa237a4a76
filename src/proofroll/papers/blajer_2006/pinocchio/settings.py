"""Settings of a ball that rolls in a cylinder in Pinocchio, and its presets."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from typing_extensions import override

from proofroll.core.engine import presets_of
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.pinocchio.settings import FREE, PinocchioSettings

_ORDERS = {"semi_implicit_euler": 1, "rk4": 2, "rk4_dexpinv": 4}  # with the orientation


@dataclass(frozen=True)
class CompositeSettings(PinocchioSettings):
    """Settings of a ball on joints about and along the cylinder's axis, so that it cannot leave it.

    Attributes:
        formulation: ``composite``: two rows of rolling are added to the joints.
        orientation: integrate the orientation of the ball; None: if the scene asks for it. Its inertia is the same
            about every axis, so the motion does not depend on it, and without it the fast turning needs no small steps.
    """

    formulation: Literal["composite"] = "composite"

    @override
    def _rules(self) -> Iterator[tuple[bool, str, str]]:
        yield self.integrator == "midpoint", "integrator", "only impulses has it"
        yield from super()._rules()

    @property
    def order(self) -> int | None:
        """See :class:`proofroll.core.engine.Settings`.

        rk4 is of order 4 only if configurations form a vector space, that is without the orientation: see
        :mod:`proofroll.papers.blajer_2006.pinocchio.integrators`. Where the scene decides, :attr:`lowered` gives the
        order with it.
        """
        return 4 if self.integrator == "rk4" and not self.orientation else _ORDERS.get(self.integrator)

    @property
    @override
    def lowered(self) -> Mapping[str, int]:
        return {MechanismCapability.ORIENTATION: _ORDERS["rk4"]} if self.integrator == "rk4" else {}


PRESETS: Mapping[str, Mapping[str, CompositeSettings]] = presets_of(
    CompositeSettings,
    {
        "composite": {
            # the obvious first model: a classical scheme with pin.integrate, which turns the ball, without drift
            # correction
            "default": {**FREE, "orientation": True},
            # the same model, integrated to round-off; without the orientation, unless the scene requires it, as the
            # fast turning of the ball's own axes would dictate the step
            "matched": {"rtol": 3e-14},
            # tightest useful tolerance: a tighter one takes a tenth more time and gains no digit
            "tuned": {},
        }
    },
)
