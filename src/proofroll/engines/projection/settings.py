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
        formulation: ``dependent``, the coordinates of the bodies, cut apart.
        preset: source of the other values.
        integrator: ``rk4`` with the fixed step ``dt``, ``dop853`` with the tolerance ``rtol``, or ``taylor`` with it:
            the same equations in compiled Taylor series (heyoka), not of ``dependent``.
        dt: step of rk4 [s].
        rtol: relative tolerance of dop853 and of taylor [1].
        elimination: remove the violation of the constraints after each step (taylor: after every few); None is yes.
        equations: ``projected``, with the projections carried out in numpy at every evaluation (of few contacts in a
            mode that lasts: recorded as plain assignments), or ``compiled`` (heyoka; trees of joints without springs of
            their own).
    """

    formulation: str = "dependent"
    preset: Literal["default", "matched", "tuned"] = "matched"
    integrator: Literal["rk4", "dop853", "taylor"] = "dop853"
    dt: Annotated[float, Gt(0)] = _DT
    rtol: Annotated[float, Gt(0)] = TIGHTEST
    elimination: bool | None = None
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
        return ("dt" if self.resolution == "rtol" else "rtol",)

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
    "dependent": {
        "default": ProjectionSettings("dependent", "default", "rk4"),
        "matched": ProjectionSettings("dependent", "matched", "dop853"),
        "tuned": ProjectionSettings("dependent", "tuned", "dop853", equations="compiled"),
    }
}
