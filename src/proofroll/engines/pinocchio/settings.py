"""Settings and presets of Pinocchio."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt

from proofroll.core.dop853 import TIGHTEST
from proofroll.core.engine import Scheme, presets_of
from proofroll.core.errors import refuse_first
from proofroll.elements.mechanism.run.capabilities import MechanismCapability

_SCHEMES = {"semi_implicit_euler": Scheme.SEMI_IMPLICIT_EULER, "rk4": Scheme.RK4}
# Formulations of mechanisms, with their integrators.
OF_MECHANISMS = {
    "null_space": ("rk4", "dop853"),
    "constraint_dynamics": ("rk4", "dop853"),
    "impulses": ("semi_implicit_euler", "midpoint"),
}


@dataclass(frozen=True)
class PinocchioSettings:
    """Settings of the Pinocchio adapter.

    Attributes:
        formulation: ``null_space`` (joint tree, loops by projection on the null space of their rows),
            ``constraint_dynamics`` (loops as Pinocchio's own rigid constraints) or ``impulses`` (a tree whose bodies
            touch, by Pinocchio's solver of contact with friction).
        preset: source of the other values.
        integrator: ``semi_implicit_euler`` and ``rk4`` as they are usually written with ``pin.integrate``;
            ``rk4_dexpinv`` the same with the missing term of rotations; ``dop853`` adaptive, order 8. ``impulses`` has
            ``semi_implicit_euler`` and Moreau's ``midpoint``, with all terms at half a step.
        dt: step [s]; None with ``dop853``.
        rtol: relative tolerance [1] of ``dop853``; None with the others.
        orientation: None: a mechanism always has its orientations.
        projection: put the state back on the constraints after each step; not in ``impulses``, where the solver does.
        solver: of ``impulses``: projected Gauss-Seidel or alternating directions (ADMM), which diverges in wide cones
            and is given each cone no wider than its impulse asks for; None with the others.
        solver_tolerance: of ``impulses``: feasibility and complementarity, relative to speeds and impulses of the step
            [1]; None with the others.
        convex: of ``impulses``: whether the solver leaves De Saxcé's term out, so that what slips parts.
        proximal: of ``constraint_dynamics``: the term μ that makes dependent rows solvable, taken back by iteration;
            None with the others.
    """

    formulation: str = "null_space"
    preset: Literal["default", "matched", "tuned"] = "matched"
    integrator: Literal["semi_implicit_euler", "midpoint", "rk4", "rk4_dexpinv", "dop853"] = "dop853"
    dt: Annotated[float, Gt(0)] | None = None
    rtol: Annotated[float, Ge(TIGHTEST)] | None = 1e-13
    orientation: bool | None = None
    projection: bool = True
    solver: Literal["pgs", "admm"] | None = None
    solver_tolerance: Annotated[float, Gt(0)] | None = None
    convex: bool = False
    proximal: Annotated[float, Gt(0)] | None = None

    @property
    def unused(self) -> tuple[str, ...]:
        """See :class:`proofroll.core.engine.Settings`."""
        return () if self.formulation == "impulses" else ("convex",)

    def __post_init__(self) -> None:
        """Refuses settings that the formulation or the integrator does not have, or that have no effect."""
        refuse_first("pinocchio", self, self._rules())

    def _rules(self) -> Iterator[tuple[bool, str, str]]:
        integrator, integrators = self.integrator, OF_MECHANISMS.get(self.formulation)
        solves = self.formulation == "impulses"
        for name in ("solver", "solver_tolerance"):
            is_set = getattr(self, name) is not None
            advice = f"{self.formulation} has no contact solver; leave it out, or take formulation=impulses"
            yield is_set and not solves, name, advice
            yield solves and not is_set, name, f"{self.formulation} needs one; its presets have one"
        yield solves and self.projection, "projection", "the solver corrects the contacts; leave it out"
        if integrators is not None:
            advice = "a mechanism always has its orientations; leave it out"
            yield self.orientation is not None, "orientation", advice
            yield integrator not in integrators, "integrator", f"{self.formulation} has {' and '.join(integrators)}"
        advice = "constraint_dynamics needs a number, and nothing else has one"
        yield (self.formulation == "constraint_dynamics") != (self.proximal is not None), "proximal", advice
        # A fixed step has dt and no rtol, an adaptive one rtol and no dt.
        if integrator == "dop853":
            advice = "dop853 chooses its steps; set rtol instead, or take the fixed steps of preset=default"
            yield self.dt is not None, "dt", advice
            yield self.rtol is None, "integrator", "dop853 needs rtol, e.g. 1e-10; preset=matched has one"
        else:
            yield self.rtol is not None, "rtol", f"{integrator} has a fixed step; start from preset=default and set dt"
            yield self.dt is None, "integrator", "a fixed step needs dt, e.g. 1e-3; preset=default has one"

    @property
    def resolution(self) -> str:
        """See :class:`proofroll.core.engine.Settings`."""
        return "rtol" if self.integrator == "dop853" else "dt"

    @property
    def order(self) -> int | None:
        """See :class:`proofroll.core.engine.Settings`."""
        return {"rk4": 4, "semi_implicit_euler": 1, "midpoint": 1}.get(self.integrator)

    @property
    def lowered(self) -> Mapping[str, int]:
        """See :class:`proofroll.core.engine_abilities.LowersOrder`."""
        return {MechanismCapability.SATURATION: 1} if self.integrator == "rk4" else {}

    @property
    def scheme(self) -> Scheme | str:
        """See :class:`proofroll.core.engine.Settings`."""
        return _SCHEMES.get(self.integrator, self.integrator)


# Any value from 1e-12 to 1e-5 gave accelerations accurate to 1e-13; with zero, dependent rows give NaN.
PROXIMAL = 1e-8


# A fixed step; ``default`` does not put the state back on the constraints.
STEPS: Mapping[str, Any] = {"integrator": "rk4", "dt": 1e-3, "rtol": None}
FREE: Mapping[str, Any] = {**STEPS, "projection": False}
_ADMM: Mapping[str, Any] = {**FREE, "integrator": "semi_implicit_euler", "solver": "admm"}
_PROXIMAL: Mapping[str, Any] = {"proximal": PROXIMAL}

PRESETS: Mapping[str, Mapping[str, PinocchioSettings]] = presets_of(
    PinocchioSettings,
    dict[str, Mapping[str, Mapping[str, Any]]](
        impulses={
            # the obvious first model: contacts at the bodies' positions when the step begins, the solver's tolerance
            "default": {**_ADMM, "solver_tolerance": 1e-6},
            # solved as accurately as ADMM can within its iterations, impacts included
            "matched": {**_ADMM, "solver_tolerance": 1e-8},
            # all terms in the middle of the step
            "tuned": {**_ADMM, "integrator": "midpoint", "solver_tolerance": 1e-8},
        },
        null_space={"default": FREE, "matched": STEPS, "tuned": {"rtol": TIGHTEST}},
        constraint_dynamics={
            "default": {**FREE, **_PROXIMAL},
            "matched": {**STEPS, **_PROXIMAL},
            "tuned": {"rtol": 1e-13, **_PROXIMAL},
        },
    ),
)
