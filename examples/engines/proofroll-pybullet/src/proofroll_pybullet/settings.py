"""Settings of PyBullet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt

from proofroll.adapter import Scheme


@dataclass(frozen=True)
class PybulletSettings:
    """Settings of PyBullet.

    Attributes:
        formulation: ``plane``, a ball against a plane posed anew in each step; ``urdf``, a mechanism as a URDF;
            ``spheres``, free bodies with spheres that touch.
        preset: ``default``: PyBullet's own options and its own step; ``matched``: no damping, slack or bound on spin.
        dt: step [s].
        iterations: iterations of the solver of contacts and loops.
    """

    formulation: Literal["plane", "urdf", "spheres"] = "plane"
    preset: Literal["default", "matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    iterations: Annotated[int, Gt(0)] = 200

    resolution: ClassVar[str] = "dt"
    scheme: ClassVar[str] = Scheme.SEMI_IMPLICIT_EULER

    @property
    def order(self) -> int | None:
        """Order of semi-implicit Euler; None for PyBullet's defaults, whose damping and slack do not shrink with dt."""
        return 1 if self.preset == "matched" else None


PRESETS: Mapping[str, Mapping[str, PybulletSettings]] = {
    name: {
        "default": PybulletSettings(name, "default", 1 / 240, 50),
        "matched": PybulletSettings(name, "matched", iterations=iterations),
    }
    # A loop in space is closed to 0.6 % of its first acceleration after 200, to 1e-7 after 2000.
    for name, iterations in (("plane", 200), ("urdf", 2000), ("spheres", 1000))
}
