"""Settings and presets of Pinocchio."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt

from proofroll.core.dop853 import TIGHTEST
from proofroll.core.engine import Scheme
from proofroll.core.errors import refuse_first
from proofroll.elements.mechanism.run.capabilities import MechanismCapability

_ORDERS = {"semi_implicit_euler": 1, "midpoint": 1, "rk4": 2, "rk4_dexpinv": 4}
_SCHEMES = {
    "semi_implicit_euler": Scheme.SEMI_IMPLICIT_EULER,
    "rk4": Scheme.RK4,
}
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
        formulation: of a ball that rolls in a cylinder ``composite`` (joints about and along its axis, so the ball
            cannot leave it, and two rows of rolling); of mechanisms ``null_space`` (joint tree, loops by projection on
            the null space of their rows), ``constraint_dynamics`` (loops as Pinocchio's own rigid constraints) or
            ``impulses`` (a tree whose bodies touch, by Pinocchio's solver of contact with friction).
        preset: source of the other values.
        integrator: ``semi_implicit_euler`` and ``rk4`` as they are usually written with ``pin.integrate``;
            ``rk4_dexpinv`` the same with the missing term of rotations; ``dop853`` adaptive, order 8. ``impulses`` has
            ``semi_implicit_euler`` and Moreau's ``midpoint``, with all terms at half a step.
        dt: step [s]; None with ``dop853``.
        rtol: relative tolerance [1] of ``dop853``; None with the others.
        orientation: integrate the orientation of the ball; None: if the scene asks for it. Its inertia is the same
            about every axis, so the motion does not depend on it, and without it the fast turning needs no small steps.
            Mechanisms always have it.
        projection: put the state back on the constraints after each step; not in ``impulses``, where the solver does.
        solver: of ``impulses``: projected Gauss-Seidel or alternating directions (ADMM), which diverges in wide cones
            and is given each cone no wider than its impulse asks for; None with the others.
        solver_tolerance: of ``impulses``: feasibility and complementarity, relative to speeds and impulses of the step
            [1]; None with the others.
        convex: of ``impulses``: whether the solver leaves De Saxcé's term out, so that what slips parts.
        proximal: of ``constraint_dynamics``: the term μ that makes dependent rows solvable, taken back by iteration;
            None with the others.
    """

    formulation: Literal["composite", "null_space", "constraint_dynamics", "impulses"] = "composite"
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
        integrator, of_mechanisms = self.integrator, OF_MECHANISMS.get(self.formulation)
        solves = self.formulation == "impulses"
        for name in ("solver", "solver_tolerance"):
            is_set = getattr(self, name) is not None
            advice = f"{self.formulation} has no contact solver; leave it out, or take formulation=impulses"
            yield is_set and not solves, name, advice
            yield solves and not is_set, name, f"{self.formulation} needs one; its presets have one"
        yield self.convex and not solves, "convex", "only impulses has it; leave it out"
        if of_mechanisms is None:
            yield integrator == "midpoint", "integrator", "only impulses has it"
        yield solves and self.projection, "projection", "the solver corrects the contacts; leave it out"
        if of_mechanisms is not None:
            advice = "a mechanism always has its orientations; leave it out"
            yield self.orientation is not None, "orientation", advice
            yield integrator not in of_mechanisms, "integrator", f"{self.formulation} has {' and '.join(of_mechanisms)}"
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
        """See :class:`proofroll.core.engine.Settings`.

        rk4 is of order 4 only if configurations form a vector space, that is without the orientation. Where the scene
        decides, :func:`lowered` gives the order with it.
        """
        if self.formulation in OF_MECHANISMS and self.formulation != "impulses":
            return 4 if self.integrator == "rk4" else None
        if self.integrator == "rk4" and not self.orientation:
            return 4
        return _ORDERS.get(self.integrator)

    @property
    def scheme(self) -> Scheme | str:
        """See :class:`proofroll.core.engine.Settings`."""
        return _SCHEMES.get(self.integrator, self.integrator)


def lowered(settings: PinocchioSettings) -> Mapping[str, int]:
    """See :class:`proofroll.core.engine_abilities.LowersOrder`."""
    if settings.integrator != "rk4":
        return {}
    return (
        {MechanismCapability.SATURATION: 1}
        if settings.formulation in OF_MECHANISMS
        else {MechanismCapability.ORIENTATION: _ORDERS["rk4"]}
    )


# Any value from 1e-12 to 1e-5 gave accelerations accurate to 1e-13; with zero, dependent rows give NaN.
PROXIMAL = 1e-8


# A fixed step; ``default`` does not put the state back on the constraints.
_STEPS: Mapping[str, Any] = {"integrator": "rk4", "dt": 1e-3, "rtol": None}
_FREE: Mapping[str, Any] = {**_STEPS, "projection": False}
_BALL: Mapping[str, Mapping[str, Any]] = {
    # the obvious first model: a classical scheme with pin.integrate, which turns the ball, without drift correction
    "default": {**_FREE, "orientation": True},
    # the same model, integrated to round-off; without the orientation, unless the scene requires it, as the fast
    # turning of the ball's own axes would dictate the step
    "matched": {"rtol": 3e-14},
    # tightest useful tolerance: a tighter one takes a tenth more time and gains no digit
    "tuned": {},
}
_ADMM: Mapping[str, Any] = {**_FREE, "integrator": "semi_implicit_euler", "solver": "admm"}
_PROXIMAL: Mapping[str, Any] = {"proximal": PROXIMAL}

PRESETS: Mapping[str, Mapping[str, PinocchioSettings]] = {
    formulation: {
        preset: PinocchioSettings(**{**values, "formulation": formulation, "preset": preset})
        for preset, values in presets.items()
    }
    for formulation, presets in dict[str, Mapping[str, Mapping[str, Any]]](
        composite=_BALL,
        impulses={
            # the obvious first model: contacts at the bodies' positions when the step begins, the solver's tolerance
            "default": {**_ADMM, "solver_tolerance": 1e-6},
            # solved as accurately as ADMM can within its iterations, impacts included
            "matched": {**_ADMM, "solver_tolerance": 1e-8},
            # all terms in the middle of the step
            "tuned": {**_ADMM, "integrator": "midpoint", "solver_tolerance": 1e-8},
        },
        null_space={"default": _FREE, "matched": _STEPS, "tuned": {"rtol": TIGHTEST}},
        constraint_dynamics={
            "default": {**_FREE, **_PROXIMAL},
            "matched": {**_STEPS, **_PROXIMAL},
            "tuned": {"rtol": 1e-13, **_PROXIMAL},
        },
    ).items()
}
