"""Settings of a ball that rolls in a cylinder in MuJoCo, its presets, and the terms that a setting switches."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Gt
from pydantic import BeforeValidator
from typing_extensions import override

from proofroll.core.engine_abilities import Term
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.mujoco.settings import (
    DEFAULT_STEP,
    LARGEST_PYRAMIDAL_FRICTION,
    ORDER_OF_TURNING,
    SLIDES,
    TURNS,
    UNBOUNDED_FRICTION,
    MujocoSettings,
)

# MuJoCo's default friction; and that against turning about the normal and against rolling: lengths [m], the same for
# balls of every radius.
_DEFAULT_FRICTION = 1.0
_DEFAULT_TURNING, _DEFAULT_ROLLING = 5e-3, 1e-4
# Least dimensions of a contact (condim) that resist rolling.
ROLLS = 6


def _digits_as_number(value: object) -> object:
    """Converts a text of digits to an int; pydantic does that for other numbers, not for those of a Literal."""
    return int(value) if isinstance(value, str) and value.isdecimal() else value


@dataclass(frozen=True)
class ChartSettings(MujocoSettings):
    """Settings of a ball on joints that follow the cylinder's coordinates, and their contact with a plane.

    Attributes:
        formulation: ``chart``: the plane is re-posed tangent to the wall at each evaluation of the forces.
        friction: coefficient that stands for unbounded friction [1]; with less than the scene needs, the ball slips.
        start: ``touching``: at depth zero, where a soft contact is not loaded yet; ``settled``: at the depth at which
            the contact already bends the path as the wall does.
        condim: dimensions of the contact's friction: 3 slides; 4 also resists turning about the normal, 6 also rolling,
            with MuJoCo's documented coefficients. No scene asks for either; they are there to be compared.
    """

    formulation: Literal["chart"] = "chart"
    friction: Annotated[float, Gt(0)] = UNBOUNDED_FRICTION
    start: Literal["touching", "settled"] = "settled"
    condim: Annotated[Literal[3, 4, 6], BeforeValidator(_digits_as_number)] = 3

    @property
    @override
    def unused(self) -> tuple[str, ...]:
        return ("damping_armature", "cone_correction", "curvature")

    @property
    def order(self) -> int | None:
        """Measured order of convergence.

        A fixed time constant makes the contact a smooth spring, and the limit no hard contact: RK4 has its order for
        turning bodies there. Otherwise it is 2.
        """
        if self.time_constant is None:
            return ORDER_OF_TURNING if self.integrator == "RK4" else 1
        return 2

    @property
    def lowered(self) -> Mapping[str, int]:
        """See :class:`proofroll.core.engine_abilities.LowersOrder`.

        The torque of rolling resistance uses a normal force that is extrapolated linearly in time.
        """
        return {MechanismCapability.TURNING_FRICTION: 2}

    @override
    def rules(self) -> Iterator[tuple[bool, str, str]]:
        soft = self.cone == "pyramidal" and self.friction > LARGEST_PYRAMIDAL_FRICTION
        advice = f"with cone=pyramidal more than {LARGEST_PYRAMIDAL_FRICTION:g} makes the wall soft; set cone=elliptic"
        yield soft, "friction", advice
        yield from super().rules()

    def friction_coefficients(self, mu: float) -> tuple[float, float, float]:
        """MuJoCo's coefficients of sliding [1], of turning about the normal [m] and of rolling [m]; 0 where unused."""
        turning = _DEFAULT_TURNING if self.condim >= TURNS else 0.0
        return mu, turning, _DEFAULT_ROLLING if self.condim >= ROLLS else 0.0


PRESETS: Mapping[str, ChartSettings] = {
    # Coordinates and integrator belong to the formulation; only the contact has MuJoCo's defaults.
    "default": ChartSettings(
        preset="default",
        dt=DEFAULT_STEP,
        cone="pyramidal",
        time_constant=None,
        impedance=None,
        friction=_DEFAULT_FRICTION,
        start="touching",
    ),
    # In these coordinates J̇v vanishes, so documented options are also the best known ones.
    "matched": ChartSettings(),
}


TERMS = (
    Term(
        name="friction against turning (condim 4)",
        formulations=("chart",),
        on={"condim": TURNS},
        off={"condim": SLIDES},
        because="resists the spin about the normal, which decides the ball's motion on a curved wall",
        rung=True,
    ),
    Term(
        name="friction against turning and rolling (condim 6)",
        formulations=("chart",),
        on={"condim": ROLLS},
        off={"condim": SLIDES},
        because="looks like rolling resistance, but sliding, turning and rolling share one cone",
        rung=True,
    ),
    Term(
        name="settled start",
        formulations=("chart",),
        on={"start": "settled"},
        off={"start": "touching"},
        because="starts the soft contact at the depth at which it already bends the path as the wall does",
    ),
)
