"""One ball that rolls in an upright cylinder and never slips, as an element of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from proofroll.core.arrays import longest
from proofroll.core.element import FirstMotion, OptionalTerm, Sign, StepNumber
from proofroll.core.engine import Regularised
from proofroll.core.program_text import FailedRun
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.certificate import CAPS, FROM_ACCELERATIONS
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.run.optional_terms import RESISTANCE
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.papers.blajer_2006.ball import failure_program

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall


def _turning_rate(body: BodyOnWall) -> float:
    """Ω: rate at which the wall's normal turns under the ball at time 0 [rad/s]; V0/c in a cylinder."""
    return float(np.linalg.norm(body.surface.normal_gradient(body.surface.position(body.u0)) @ body.v0))


def natural_time(body: BodyOnWall) -> float:
    """Period of the slowest motion that the ball starts with [s].

    Where the path turns at the rate Ω, a ball with r = J/(m a²) oscillates across it at √(r/(1+r)) Ω (√(2/7) Ω for a
    homogeneous ball, Blajer 2006, section 3). On a straight path there is no oscillation: it is one turn of the ball,
    or 2π √(a/g), the time scale of starting to roll, whichever is longer.
    """
    turning, ratio = _turning_rate(body), body.ball.inertia_ratio
    if turning > 0:
        return 2 * math.pi / (math.sqrt(ratio / (1 + ratio)) * turning)
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    times = [a / speed] if speed else []
    times += [math.sqrt(a / gravity)] if gravity else []
    return 2 * math.pi * max(times, default=1.0)


def step_numbers(body: BodyOnWall, h: float, truth: xr.Dataset | None) -> tuple[StepNumber, ...]:
    """See :class:`proofroll.core.element.Element`."""
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    fastest = None
    if truth is not None:
        fastest = float(np.max(np.linalg.norm(truth["w_WB"].to_numpy(), axis=-1)))
    return (
        StepNumber("turn", "Ωh", "angle [rad] by which the wall's normal turns in a step", _turning_rate(body) * h),
        StepNumber("spin", "(V0/a)h", "angle [rad] by which the ball turns in a step", speed / a * h),
        StepNumber(
            "rotation",
            "h|ω|",
            "angle [rad] by which the ball turns in a step where it turns fastest",
            None if fastest is None else fastest * h,
        ),
        StepNumber("fall", "h√(g/a)", "step in parts of the time of a fall by the radius", math.sqrt(gravity / a) * h),
    )


_DEEP = "a ball that is sunk in by its radius has its centre in the wall"
_LEVER = "a soft contact rolls about a point midway in its depth, and the depth is at most the radius"
_UNLOADED = "a contact that is not loaded yet lacks the whole force"
# Rolling resistance [radii] that a scene without any gets to see the cost of the term (Blajer 2006, figure 5).
_RESISTANCE = 0.02


@dataclass(frozen=True)
class EvenRolling(MechanismElement):
    """A mechanism that is one ball in an upright cylinder, with friction that has no bound.

    Its formulations need not follow its orientation; failures of its runs are those of a ball, and times are those of
    its path.
    """

    caps: ClassVar[Mapping[str, Regularised]] = {
        **CAPS,
        **dict.fromkeys(FROM_ACCELERATIONS, Regularised(1.0, _UNLOADED)),
        **dict.fromkeys(("gaps", "position", "places of contact"), Regularised(1.0, _DEEP)),
        **dict.fromkeys(("spin", "velocity"), Regularised(0.5, _LEVER)),
        "rolling resistance": Regularised(1e-6, "its moment is read back through a normal force, which a solver finds"),
        "inverse friction": Regularised(float("inf"), "a finite number stands for unbounded friction"),
    }
    failures: ClassVar[Mapping[str, str]] = failure_program.MEANINGS
    askable: ClassVar[Mapping[str, str]] = {"orientation": MechanismCapability.ORIENTATION}

    @cached_property
    def requires(self) -> frozenset[str]:
        """See the protocol: its formulations need not have free bodies."""
        return super().requires - {MechanismCapability.FREE}

    @property
    def optional(self) -> frozenset[str]:
        """See :class:`proofroll.core.element_abilities.HasOptionalCapabilities`."""
        return frozenset({MechanismCapability.TURNING_FRICTION, *self.askable.values()})

    @property
    def _ball(self) -> BodyOnWall:
        assert self.on_wall is not None  # by the kind that made it
        return self.on_wall

    @cached_property
    def natural_time(self) -> float:
        """Period of the slowest motion that the ball starts with [s]."""
        return natural_time(self._ball)

    @property
    def first_motion(self) -> FirstMotion:
        """See the protocol; the wall turns the ball, whatever its own length."""
        motion, pull = super().first_motion, float(np.linalg.norm(self.mechanism.gravity))
        return replace(motion, scale=float(np.fmax(longest(motion.acceleration), pull)) or 1.0, pull=pull or None)

    def step_numbers(self, h: float, truth: xr.Dataset | None) -> Sequence[StepNumber]:
        """See the protocol."""
        return step_numbers(self._ball, h, truth)

    def lacks(self, samples: Sequence[MechanismSample], asks: Sequence[str]) -> str | None:
        """See the protocol: its orientation is lacking where it is asked for."""
        return super().lacks(samples, asks) if "orientation" in asks else None

    def signs(self, dataset: xr.Dataset, truth: xr.Dataset | None) -> list[Sign]:
        """See the protocol."""
        return failure_program.signs(self._ball, dataset, truth)

    def cause(self, dataset: xr.Dataset, error: float) -> str | None:
        """See :class:`proofroll.core.element_abilities.ExplainsErrors`."""
        return failure_program.cause(self._ball, dataset, error)

    def failure_program(self, failed: FailedRun, engine: str | None) -> str:
        """See :class:`proofroll.core.element_abilities.WritesPrograms`."""
        return failure_program.program(self._ball, failed, engine)

    def optional_terms(self, parameters: Mapping[str, float], truth: xr.Dataset) -> list[OptionalTerm]:
        """See the protocol: resistance if the scene has none, and orientation."""
        terms = super().optional_terms(parameters, truth)
        if parameters.get("rolling_resistance") == 0.0:
            f = _RESISTANCE * self._ball.ball.radius
            put, taken = {"rolling_resistance": f}, {"rolling_resistance": 0.0}
            terms.append(OptionalTerm(RESISTANCE, f"the scene has none; here with f = {f:g} m", put, taken))
        because, need = "nothing else depends on it", MechanismCapability.ORIENTATION
        return [*terms, OptionalTerm("orientation asked", because, asks=("orientation",), capability=need)]
