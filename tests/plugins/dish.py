"""Surface of revolution of another package, declared by its profile curve alone."""

# ruff: noqa: D102 -- what the method means is said in Revolved

from __future__ import annotations

import dataclasses
from typing import Any, Literal

from proofroll.elements.mechanism.scene.shapes.walls.revolved import Revolved


@dataclasses.dataclass(frozen=True)
class Dish(Revolved):
    """Inside of a paraboloid.

    Attributes:
        name: name to which contacts refer.
        focus: height of the focus above the bottom [m].
        kind: kind of the surface.
    """

    name: str
    focus: float = dataclasses.field(metadata={"unit": "m"})
    kind: Literal["dish"] = "dish"
    coordinates = ("gamma", "s")
    extent = (0.0, 0.5)

    def profile(self, s: Any) -> tuple[Any, Any]:
        return s, s * s / (4 * self.focus)
