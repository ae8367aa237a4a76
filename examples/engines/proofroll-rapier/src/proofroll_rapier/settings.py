"""Settings of Rapier, and its presets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt

from proofroll.adapter import Scheme

# Step of Rapier's own default parameters [s].
_RAPIER_STEP = 1 / 60
# Of joints that are springs to the solver [rad/s], with critical damping: as hard as single precision takes.
HARD = 1e6


@dataclass(frozen=True)
class RapierSettings:
    """Settings of Rapier.

    Attributes:
        formulation: ``impulse``: impulses hold all joints; ``multibody``: trees have joint coordinates.
        preset: ``default`` is Rapier as it comes; ``matched`` is hard and undamped.
        dt: step [s].
        iterations: of the solver in a step, each a part of the step (Rapier's small steps).
    """

    formulation: Literal["impulse", "multibody"] = "multibody"
    preset: Literal["default", "matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    iterations: Annotated[int, Gt(0)] = 20

    resolution: ClassVar[str] = "dt"
    order: ClassVar[int | None] = None  # single precision hides it where loops close
    precision: ClassVar[str] = "single"
    scheme: ClassVar[str] = Scheme.SEMI_IMPLICIT_EULER


PRESETS: Mapping[str, Mapping[str, RapierSettings]] = {
    formulation: {
        "matched": RapierSettings(formulation),
        "default": RapierSettings(formulation, "default", _RAPIER_STEP, iterations=4),
    }
    for formulation in ("multibody", "impulse")
}
