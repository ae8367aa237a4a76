"""Settings of the Exudyn adapter and the presets of its formulations."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Gt, Interval

from proofroll.core.engine import Scheme, presets_of
from proofroll.core.errors import InputError


@dataclass(frozen=True)
class ExudynSettings:
    """Settings of Exudyn: model of the scene and integration. A setting that would do nothing is None.

    Attributes:
        formulation: ``redundant`` (bodies in redundant coordinates, joints as constraints), ``spheres`` (the same with
            its penalty contacts of spheres), ``discs`` (with its rolling-disc joint for circles on planes) or ``tree``
            (its kinematic tree in joint coordinates).
        preset: name of the preset that supplies the other values.
        dt: fixed time step [s].
        integrator: ``generalized_alpha`` (constraints at position level, index 3) or ``trapezoidal_index2``
            (undamped, constraints at velocity level); of ``tree`` ``rk44`` or ``rk67``, explicit.
        spectral_radius: of the generalized-alpha method at infinite frequency [1]; 1 damps nothing. None: the engine's
            own, 0.9. The trapezoidal rule has no damping and ignores it.
        newton_tolerance: relative tolerance of Newton's method [1]; the absolute one is a hundredth of it, which is
            the engine's own ratio, and as much for each kilogram of a mechanism heavier than 1 kg. Explicit integrators
            ignore it and ``jacobian``.
        jacobian: ``reused`` while Newton's method contracts, or computed anew at every ``step``.
        halvings: number of times a step is halved where Newton's method fails, before the run ends. With 0, and in
            formulations other than ``spheres``, all steps are dt.
        stiffness: stiffness of the normal force [N/m]; this and the next: ``spheres`` only.
        friction_zone: slip velocity up to which friction is proportional to it [m/s]. For unbounded friction there is a
            coefficient of 100, with a zone as much wider.
    """

    formulation: str = "redundant"
    preset: Literal["default", "matched", "tuned"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-4
    integrator: Literal["generalized_alpha", "trapezoidal_index2", "rk44", "rk67"] = "trapezoidal_index2"
    spectral_radius: Annotated[float, Interval(ge=0, le=1)] | None = None
    newton_tolerance: Annotated[float, Interval(gt=0, lt=1)] = 1e-10
    jacobian: Literal["reused", "step"] = "step"
    halvings: Annotated[int, Interval(ge=0, le=20)] | None = None
    stiffness: Annotated[float, Gt(0)] | None = None
    friction_zone: Annotated[float, Gt(0)] | None = None

    resolution: ClassVar[str] = "dt"

    @property
    def order(self) -> int:
        """Order of the integrator: both implicit methods have 2 in positions, velocities and multipliers."""
        return EXPLICIT.get(self.integrator, 2)

    @property
    def scheme(self) -> Scheme | str:
        """See :class:`proofroll.core.engine.Settings`."""
        return Scheme.RK4 if self.integrator == "rk44" else self.integrator

    def __post_init__(self) -> None:
        """Raises InputError if a setting has no effect, or the formulation lacks one that it needs."""
        if (self.integrator in EXPLICIT) != (self.formulation == "tree"):
            advice = f"tree has {' and '.join(EXPLICIT)}, the others have implicit integrators"
            raise InputError("exudyn: integrator", self.integrator, advice)
        if self.integrator == "trapezoidal_index2":
            self._has_no("spectral_radius", "the trapezoidal rule has no damping; set integrator=generalized_alpha")
        if self.integrator in EXPLICIT:
            self._has_no("spectral_radius", "explicit integrators have no damping; leave it out")
        for name in _OF_CONTACT:
            if self.formulation != "spheres":
                self._has_no(name, f"{self.formulation} does not use it; set formulation=spheres")
            elif getattr(self, name) is None:
                raise InputError(f"exudyn: {name}", None, f"formulation={self.formulation} needs a number")

    def _has_no(self, name: str, advice: str) -> None:
        value = getattr(self, name)
        if value is None:
            return
        # The value may come from the preset, whose integrator the user has replaced: then it is dropped.
        if value != getattr(self._presets().get(self.formulation, {}).get(self.preset), name, None):
            raise InputError(f"exudyn: {name}", value, advice)
        object.__setattr__(self, name, None)

    @staticmethod
    def _presets() -> "Mapping[str, Mapping[str, ExudynSettings]]":
        """Presets of the formulations that have these settings."""
        return PRESETS

    @property
    def penalty(self) -> tuple[float, float]:
        """Stiffness [N/m] and friction zone [m/s] of the contact."""
        assert self.stiffness is not None  # see __post_init__, here and below
        assert self.friction_zone is not None
        return self.stiffness, self.friction_zone


# Explicit integrators, and their order.
EXPLICIT = {"rk44": 4, "rk67": 6}
# Settings of the penalty contact.
_OF_CONTACT = ("halvings", "stiffness", "friction_zone")

# ``default`` is Exudyn's own choice of integrator, damping and Newton options at a common step of 1e-3 s; its own step
# is a hundredth of the simulated time. Only ``spheres`` have Exudyn's adaptive step: see ``simulation_settings``.
OWN: Mapping[str, Any] = {
    "dt": 1e-3,
    "integrator": "generalized_alpha",
    "spectral_radius": 0.9,
    "newton_tolerance": 1e-8,
    "jacobian": "reused",
}
VELOCITIES: Mapping[str, Any] = {**OWN, "integrator": "trapezoidal_index2", "spectral_radius": None}
# Adaptive step and friction zone as Exudyn has them; a stiffness it does not have.
_PENALTY: Mapping[str, Any] = {"halvings": 10, "stiffness": 1e6, "friction_zone": 1e-3}

PRESETS: Mapping[str, Mapping[str, ExudynSettings]] = presets_of(
    ExudynSettings,
    dict[str, Mapping[str, Mapping[str, Any]]](
        redundant={
            "default": OWN,
            # Passes singular poses and dependent constraints, and keeps loops closed to round-off. A tolerance of 1e-10
            # takes four fifths of the error out of the forces of stiff small mechanisms; a new Jacobian at every step
            # ends Newton's method where constraints depend on each other.
            "matched": {**OWN, "newton_tolerance": 1e-10},
            # Constraints at velocity level: loops open by 1e-6 m at 1e-3 s, and forces are a hundred times as accurate:
            # on the slider-crank off by 8e-3 of 87 N, at second order. No other reading of multipliers mends that, for
            # exact reactions at these states, 5e-5 rad off themselves, are off by 1.4e-2 N; Newmark's β below 1/4,
            # which Exudyn offers too, and nodes without Euler parameters do worse.
            # Dependent constraints leave Newton's method with more round-off than a tighter tolerance asks for.
            "tuned": VELOCITIES,
        },
        spheres={
            "default": {**OWN, **_PENALTY},
            # A tenth of the default's creep.
            "matched": {**OWN, **_PENALTY, "jacobian": "step", "friction_zone": 1e-4},
        },
        discs={
            "default": OWN,
            # The joint constrains velocities; the trapezoidal rule tells forces that are some per cent off at any step.
            "matched": {**OWN, "newton_tolerance": 1e-10, "jacobian": "step"},
        },
        tree={"default": {"dt": 1e-3, "integrator": "rk44"}, "matched": {"dt": 1e-3, "integrator": "rk67"}},
    ),
)
