"""Surface of another package: a horizontal half-pipe, declared by its points and its distance."""

# ruff: noqa: D102 -- what the methods mean is said in Declared

from __future__ import annotations

import dataclasses
import math
from typing import Any, Literal

from proofroll.elements.mechanism.scene.shapes.walls import Declared
from proofroll.elements.mechanism.scene.shapes.walls.formula import cos, sin, sqrt


@dataclasses.dataclass(frozen=True)
class Trough(Declared):
    """Inside of a half-pipe along x.

    Attributes:
        name: name to which contacts refer.
        radius: inner radius [m].
        kind: kind of the surface.
    """

    name: str
    radius: float = dataclasses.field(metadata={"unit": "m"})
    kind: Literal["trough"] = "trough"
    coordinates = ("angle", "way")
    units = ("rad", "m")
    domain = ((-0.5 * math.pi, 0.5 * math.pi), (-1.0, 1.0))

    def offset(self, ball_radius: float) -> Trough:
        return dataclasses.replace(self, radius=self.radius - ball_radius)

    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        return u2, self.radius * sin(u1), -self.radius * cos(u1)

    def distance(self, x: Any, y: Any, z: Any) -> Any:  # noqa: ARG002 -- the same along x
        return self.radius - sqrt(y * y + z * z)
