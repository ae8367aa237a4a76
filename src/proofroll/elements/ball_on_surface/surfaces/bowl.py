"""The inside of a sphere."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.bounds import require_bounds
from proofroll.core.errors import InputError
from proofroll.elements.ball_on_surface.surfaces.declared import Declared
from proofroll.elements.mechanism.scene.shapes.walls.of_revolution import bowl_distance


@dataclass(frozen=True)
class Bowl(Declared):
    """Inside of a sphere about the world's origin; coordinates are its stereographic projection from the top [m].

    They are regular everywhere but at the top; an angle about the axis would be singular at the bottom. At the bottom
    xi points along x and eta against y.

    Attributes:
        name: used by contacts.
        kind: name of the surface in scene files.
        radius: radius [m]; of the wall in a scene, of the sphere of the centre after :meth:`offset`.
    """

    name: str
    radius: float = field(metadata={"unit": "m"})
    kind: Literal["bowl"] = "bowl"

    coordinates = ("xi", "eta")
    units = ("m", "m")

    def __post_init__(self) -> None:
        require_bounds("radius", self.radius, above=0)

    @property
    @override
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        equator = 2 * self.radius
        return (-equator, equator), (-equator, equator)

    @override
    def offset(self, ball_radius: float) -> Bowl:
        if not ball_radius < self.radius:
            raise InputError("radius", ball_radius, f"the ball must be smaller than {self.name} with {self.radius:g} m")
        return dataclasses.replace(self, radius=self.radius - ball_radius)

    @override
    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        x, y = u1 / (2 * self.radius), u2 / (2 * self.radius)
        square = x * x + y * y
        size = self.radius / (1.0 + square)
        return 2.0 * x * size, -2.0 * y * size, (square - 1.0) * size

    @override
    def distance(self, x: Any, y: Any, z: Any) -> Any:
        return bowl_distance(self.radius, x, y, z)

    @override
    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        p = np.asarray(p_WB, dtype=np.float64)
        below = np.linalg.norm(p, axis=-1, keepdims=True) - p[..., 2:]
        return np.asarray(2 * self.radius * p[..., :2] / below * [1.0, -1.0])
