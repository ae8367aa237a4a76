"""Settings of Drake."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Gt, Le

from proofroll.adapter import InputError, Scheme


@dataclass(frozen=True)
class DrakeSettings:
    """Settings of Drake.

    Attributes:
        formulation: ``terms``, a ball by Drake's mass matrix, bias and Jacobian; ``continuous`` and ``discrete``,
            mechanisms as a plant of that kind; ``contact``, bodies that touch in a discrete plant.
        preset: ``default`` or ``matched``.
        integrator: of the continuous plant, by Drake's name.
        rtol: relative tolerance of integration; None for discrete plants.
        dt: step of the discrete plant [s].
        contact: approximation of contact, by Drake's name.
    """

    formulation: Literal["terms", "continuous", "discrete", "contact"] = "continuous"
    preset: Literal["default", "matched"] = "matched"
    integrator: Literal["runge_kutta3", "runge_kutta5"] | None = None
    rtol: Annotated[float, Gt(0), Le(1)] | None = None
    dt: Annotated[float, Gt(0)] | None = None
    contact: Literal["tamsi", "sap", "lagged"] = "tamsi"

    def __post_init__(self) -> None:
        """Raises InputError unless discrete formulations have a step alone, and the others a tolerance alone."""
        wanted, other = (self.resolution, "rtol" if self.resolution == "dt" else "dt")
        if getattr(self, wanted) is None:
            raise InputError(f"drake: {wanted}", None, f"{self.formulation} needs it; give a positive number")
        if getattr(self, other) is not None:
            raise InputError(f"drake: {other}", getattr(self, other), f"{self.formulation} has none; leave it out")

    @property
    def resolution(self) -> str:
        """Name of the setting that trades speed for accuracy."""
        return "dt" if self.formulation in {"discrete", "contact"} else "rtol"

    @property
    def order(self) -> int | None:
        """Order of the discrete plant's semi-implicit Euler; None: steps are adaptive."""
        return 1 if self.resolution == "dt" else None

    @property
    def scheme(self) -> str:
        """Integration scheme of the discrete plant; empty for the others."""
        return Scheme.SEMI_IMPLICIT_EULER if self.resolution == "dt" else ""


PRESETS: Mapping[str, Mapping[str, DrakeSettings]] = {
    "terms": {"matched": DrakeSettings("terms", "matched", rtol=1e-12)},
    "continuous": {
        # defaults of Drake's Simulator
        "default": DrakeSettings("continuous", "default", "runge_kutta3", 1e-3),
        "matched": DrakeSettings("continuous", "matched", "runge_kutta5", 1e-10),
    },
    "discrete": {"default": DrakeSettings("discrete", "default", dt=1e-3)},
    "contact": {
        "default": DrakeSettings("contact", "default", dt=1e-3, contact="lagged"),  # default of Drake's plant
        "matched": DrakeSettings("contact", "matched", dt=1e-3, contact="tamsi"),
    },
}
