"""Settings of Jolt, and its presets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt

from proofroll.adapter import Scheme


@dataclass(frozen=True)
class JoltSettings:
    """Settings of Jolt.

    Attributes:
        formulation: ``impulse``: impulses hold all joints.
        preset: ``default`` is Jolt at culverin's own step, where slow bodies fall asleep; ``matched`` keeps all awake.
        dt: step [s].
    """

    formulation: Literal["impulse"] = "impulse"
    preset: Literal["default", "matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3

    resolution: ClassVar[str] = "dt"
    order: ClassVar[int | None] = None  # the damping of all bodies is left at any step
    precision: ClassVar[str] = "single"
    scheme: ClassVar[str] = Scheme.SEMI_IMPLICIT_EULER


PRESETS: Mapping[str, Mapping[str, JoltSettings]] = {
    "impulse": {"matched": JoltSettings(), "default": JoltSettings(preset="default", dt=1 / 60)}
}
