"""Settings of MJX, its presets and what it provides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt

from proofroll.adapter import MechanismCapability, Scheme

# Order of convergence and rule of each integrator.
_ORDERS = {"Euler": 1, "implicitfast": 1, "RK4": 4}
_RULES = {"Euler": Scheme.SEMI_IMPLICIT_EULER, "implicitfast": "implicitfast", "RK4": Scheme.RK4}
_PRECISIONS = {"f64": "double", "f32": "single"}


@dataclass(frozen=True)
class MjxSettings:
    """Settings of MJX.

    Attributes:
        formulation: ``f64`` or ``f32``, which JAX computes in.
        preset: ``matched`` has MuJoCo's hardest constraints.
        dt: step [s].
        integrator: MuJoCo's name of it.
    """

    formulation: Literal["f64", "f32"] = "f64"
    preset: Literal["matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    integrator: Literal["Euler", "implicitfast", "RK4"] = "Euler"

    resolution: ClassVar[str] = "dt"

    @property
    def order(self) -> int | None:
        """Order of convergence; single precision hides it where loops close."""
        return _ORDERS[self.integrator] if self.formulation == "f64" else None

    @property
    def precision(self) -> str:
        """Precision of the arithmetic."""
        return _PRECISIONS[self.formulation]

    @property
    def scheme(self) -> str:
        """Rule of integration."""
        return _RULES[self.integrator]


PRESETS: Mapping[str, Mapping[str, MjxSettings]] = {name: {"matched": MjxSettings(name)} for name in _PRECISIONS}
PROVIDES = frozenset(
    {
        MechanismCapability.FIXED,
        MechanismCapability.REVOLUTE,
        MechanismCapability.PRISMATIC,
        MechanismCapability.CYLINDRICAL,
        MechanismCapability.UNIVERSAL,
        MechanismCapability.SPHERICAL,
        MechanismCapability.PLANAR,
        MechanismCapability.FREE,
        MechanismCapability.REVOLUTE_LOOP,
        MechanismCapability.SPHERICAL_LOOP,
        MechanismCapability.REDUNDANT,
        MechanismCapability.JOINT_SPRINGS,
        MechanismCapability.ARMATURE,
        MechanismCapability.STOPS,
        MechanismCapability.ACTUATORS,
        MechanismCapability.SATURATION,
        MechanismCapability.HELD,
    }
)
LACKING = {
    MechanismCapability.CONTACT: "this adapter builds no contacts",
    MechanismCapability.JOINT_FRICTION: "this adapter does not tell how soft dry friction is",
    MechanismCapability.COUPLINGS: "this adapter builds no gears between joints",
    MechanismCapability.SPRINGS: "this adapter builds no springs between points",
    MechanismCapability.APPLIED_FORCES: "this adapter sets no forces from outside",
    MechanismCapability.SIGNALS: "this adapter sets targets between instants alone",
    MechanismCapability.REBOUNDS: "MuJoCo's limits have no restitution",
}
