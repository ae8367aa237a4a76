"""Settings of the projection method."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Gt

from proofroll.core import heyoka_library as library
from proofroll.core.dop853 import TIGHTEST
from proofroll.core.engine import Scheme
from proofroll.core.errors import refuse_first
from proofroll.core.integrators import INTEGRATORS

_DT = 1e-3


@dataclass(frozen=True)
class ProjectionSettings:
    """Settings of the projection method.

    Attributes:
        formulation: of balls, ``euler``, the paper's angles, with a singularity, or ``rotating_frame``, the angular
            velocity along the local axes, without. The angles are always part of the equations; in the rotating frame
            the orientation is followed, as a quaternion, only for a scene that asks for it. Of mechanisms,
            ``dependent``, the coordinates of the bodies, cut apart.
        preset: source of the other values.
        integrator: ``rk4`` with the fixed step ``dt``, ``dop853`` with the tolerance ``rtol``, or ``taylor`` with it:
            the same equations in compiled Taylor series (heyoka), of a ball.
        dt: step of rk4 [s].
        rtol: relative tolerance of dop853 and of taylor [1].
        elimination: remove the violation of the rolling constraints after each step (taylor: after every few); None
            is yes. In ``rotating_frame`` on a surface of constant curvature no step leaves a violation, for there the
            constraints are linear with constant coefficients, but round-off does, and it grows.
        singularity: action of ``euler`` near θ = 0 and π: ``renew``, choose the body's axes anew and say so, or
            ``stop``, as the paper's equations do by themselves.
        equations: ``projected``, with the projections carried out in numpy at every evaluation, or of mechanisms
            ``compiled`` (heyoka; trees of joints without springs of their own).
    """

    formulation: Literal["euler", "rotating_frame", "dependent"] = "euler"
    preset: Literal["default", "matched", "tuned"] = "matched"
    integrator: Literal["rk4", "dop853", "taylor"] = "dop853"
    dt: Annotated[float, Gt(0)] = _DT
    rtol: Annotated[float, Gt(0)] = TIGHTEST
    elimination: bool | None = None
    singularity: Literal["renew", "stop"] = "renew"
    equations: Literal["projected", "compiled"] = "projected"

    def __post_init__(self) -> None:
        refuse_first("projection", self, self._rules())

    def _rules(self) -> Iterator[tuple[bool, str, str]]:
        taylor, dependent = self.integrator == "taylor", self.formulation == "dependent"
        tightest = library.TIGHTEST if taylor else TIGHTEST
        yield self.rtol < tightest, "rtol", f"double precision allows no less than {tightest:.3g}"
        # Settings without effect are errors: a user who writes dt=1e-4 believes that it does something.
        advice = f"{self.integrator} chooses its own steps; set rtol, or add integrator=rk4"
        yield self.resolution == "rtol" and self.dt != _DT, "dt", advice
        advice = f"{self.integrator} has a fixed step; set dt, or add integrator=dop853"
        yield self.resolution == "dt" and self.rtol != TIGHTEST, "rtol", advice
        yield dependent and taylor, "integrator", "dependent has rk4 and dop853"
        advice = "only mechanisms have compiled equations; leave it out, or take integrator=taylor"
        yield self.equations == "compiled" and not dependent, "equations", advice
        advice = f"{self.formulation} has no angles, hence no singularity; leave it out, or take formulation=euler"
        yield self.singularity == "stop" and self.formulation != "euler", "singularity", advice

    @property
    def eliminates(self) -> bool:
        """True if violations are removed."""
        return self.elimination is not False

    @property
    def resolution(self) -> Literal["dt", "rtol"]:
        """Name of the setting that trades speed for accuracy."""
        return "rtol" if self.integrator == "taylor" else INTEGRATORS[self.integrator].resolution

    @property
    def unused(self) -> tuple[str, ...]:
        """See :class:`proofroll.core.engine.Settings`."""
        idle = "dt" if self.resolution == "rtol" else "rtol"
        idle_option = {"euler": "singularity", "dependent": "equations"}.get(self.formulation)
        return (idle, *(name for name in ("singularity", "equations") if name != idle_option))

    @property
    def order(self) -> int | None:
        """Declared order of convergence in dt; None with an adaptive step."""
        return None if self.integrator == "taylor" else INTEGRATORS[self.integrator].order

    @property
    def scheme(self) -> Scheme | str:
        """See :class:`proofroll.core.engine.Settings`."""
        return Scheme.RK4 if self.integrator == "rk4" else self.integrator


# default: what a reader of the paper would write, a classical fixed-step method with elimination of violations.
# matched: the same equations, integrated to round-off. tuned: the same, compiled.
PRESETS: Mapping[str, Mapping[str, ProjectionSettings]] = {
    "euler": {
        "default": ProjectionSettings("euler", "default", "rk4"),
        "matched": ProjectionSettings("euler", "matched", "dop853"),
        "tuned": ProjectionSettings("euler", "tuned", "taylor", rtol=library.TIGHTEST),
    },
    "rotating_frame": {
        "default": ProjectionSettings("rotating_frame", "default", "rk4"),
        "matched": ProjectionSettings("rotating_frame", "matched", "dop853"),
        "tuned": ProjectionSettings("rotating_frame", "tuned", "taylor", rtol=library.TIGHTEST),
    },
    "dependent": {
        "default": ProjectionSettings("dependent", "default", "rk4"),
        "matched": ProjectionSettings("dependent", "matched", "dop853"),
        "tuned": ProjectionSettings("dependent", "tuned", "dop853", equations="compiled"),
    },
}
