"""Settings of MuJoCo Warp, its presets and what it provides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt

from proofroll.adapter import MechanismCapability, Scheme

# Order of convergence, name in MuJoCo and rule of each integrator.
_ORDERS = {"euler": 1, "implicitfast": 1, "rk4": 4}
_RULES = {"euler": Scheme.SEMI_IMPLICIT_EULER, "implicitfast": "implicitfast", "rk4": Scheme.RK4}
INTEGRATORS = {"euler": "Euler", "implicitfast": "implicitfast", "rk4": "RK4"}


@dataclass(frozen=True)
class MujocoWarpSettings:
    """Settings of MuJoCo Warp.

    Attributes:
        formulation: integrator.
        preset: ``matched`` has MuJoCo's hardest constraints.
        dt: step [s].
    """

    formulation: Literal["euler", "implicitfast", "rk4"] = "euler"
    preset: Literal["matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3

    resolution: ClassVar[str] = "dt"
    precision: ClassVar[str] = "single"

    @property
    def order(self) -> int | None:
        """Order of convergence; single precision hides that of RK4."""
        return 1 if _ORDERS[self.formulation] == 1 else None

    @property
    def scheme(self) -> str:
        """Rule of integration."""
        return _RULES[self.formulation]


PRESETS: Mapping[str, Mapping[str, MujocoWarpSettings]] = {
    name: {"matched": MujocoWarpSettings(name)} for name in _ORDERS
}
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
