"""Tables of the surfaces in a scene file that a ball touches; the general mechanics follows a ball on them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cache
from typing import Any, Literal, Self

from proofroll.core.bounds import OutOfBounds, require_bounds
from proofroll.core.entry_points import leave_out, loaded
from proofroll.core.errors import InputError


@dataclass(frozen=True)
class Cylinder:
    """Inside of a circular cylinder; coordinates are the angle γ about its axis and the height z along it.

    Attributes:
        name: used by contacts.
        kind: name of the surface in scene files.
        radius: radius [m]; of the wall in a scene, of the centre's path after :meth:`offset`.
        tilt: rotation of the axis from the vertical about the world's y axis [rad].
    """

    name: str
    radius: float = field(metadata={"unit": "m"})
    tilt: float = field(default=0.0, metadata={"unit": "rad"})
    kind: Literal["cylinder"] = "cylinder"

    units = ("rad", "m")

    def __post_init__(self) -> None:
        require_bounds("radius", self.radius, above=0)
        require_bounds("tilt", self.tilt)

    def offset(self, ball_radius: float) -> Self:
        """Surface on which the centre of a touching ball of this radius [m] moves."""
        if not ball_radius < self.radius:
            raise InputError("radius", ball_radius, f"the ball must be smaller than {self.name} with {self.radius:g} m")
        return replace(self, radius=self.radius - ball_radius)


@dataclass(frozen=True)
class Plane:
    """Plane through the world's origin; coordinates are the distances down the slope and across it.

    Attributes:
        name: used by contacts.
        kind: name of the surface in scene files.
        tilt: rotation from the horizontal about the world's y axis [rad]; positive descends along +x.
        height: height of the plane above the world's origin, along its normal [m].
        turning: rate of a turntable, about the normal through the world's origin, upwards [rad/s].
    """

    name: str
    tilt: float = field(default=0.0, metadata={"unit": "rad"})
    height: float = field(default=0.0, metadata={"unit": "m"})
    turning: float = field(default=0.0, metadata={"unit": "rad/s"})
    kind: Literal["plane"] = "plane"

    units = ("m", "m")

    def __post_init__(self) -> None:
        require_bounds("tilt", self.tilt)
        require_bounds("height", self.height)
        require_bounds("turning", self.turning)


@dataclass(frozen=True)
class Bowl:
    """Inside of a sphere about the world's origin; coordinates are its stereographic projection from the top [m].

    They are regular everywhere but at the top; an angle about the axis would be singular at the bottom. At the bottom
    xi points along x and eta against y.

    Attributes:
        name: used by contacts.
        kind: name of the surface in scene files.
        radius: radius [m].
    """

    name: str
    radius: float = field(metadata={"unit": "m"})
    kind: Literal["bowl"] = "bowl"

    units = ("m", "m")

    def __post_init__(self) -> None:
        require_bounds("radius", self.radius, above=0)


@dataclass(frozen=True)
class Cone:
    """Inside of a cone that opens upwards; coordinates are the angle about its axis and the distance from its tip.

    Attributes:
        name: used by contacts.
        kind: name of the surface in scene files.
        slope: of the wall from the horizontal [rad].
        length: from the tip to the rim, along the wall [m]; only for drawings and checks.
        tip: height of the tip [m].
    """

    name: str
    slope: float = field(metadata={"unit": "rad"})
    length: float = field(default=1.0, metadata={"unit": "m"})
    tip: float = field(default=0.0, metadata={"unit": "m"})
    kind: Literal["cone"] = "cone"

    units = ("rad", "m")

    def __post_init__(self) -> None:
        require_bounds("slope", self.slope, above=0)
        if not self.slope < math.pi / 2:
            raise OutOfBounds("slope", self.slope, "the value must be below a right angle")
        require_bounds("length", self.length, above=0)
        require_bounds("tip", self.tip)


@dataclass(frozen=True)
class Torus:
    """Outside of a ring of round wire; coordinates are the angle about its axis and that around the wire.

    Attributes:
        name: used by contacts.
        kind: name of the surface in scene files.
        ring_radius: of the wire's middle from the axis [m].
        wire_radius: radius of the wire [m].
    """

    name: str
    ring_radius: float = field(metadata={"unit": "m"})
    wire_radius: float = field(metadata={"unit": "m"})
    kind: Literal["torus"] = "torus"

    units = ("rad", "rad")

    def __post_init__(self) -> None:
        require_bounds("ring_radius", self.ring_radius, above=0)
        require_bounds("wire_radius", self.wire_radius, above=0)
        if not self.wire_radius < self.ring_radius:
            raise OutOfBounds("wire_radius", self.wire_radius, f"the value must be below {self.ring_radius:g}")


@cache
def surface_kinds() -> tuple[type[Any], ...]:
    """Tables of surfaces that a scene can name; those of other packages are dataclasses on :class:`.Declared`."""
    others = list[Any]()
    for point, kind in loaded("proofroll.surfaces"):
        if is_dataclass(kind):
            others.append(kind)
        else:
            leave_out(point, "is no dataclass")
    return (Cylinder, Plane, Bowl, Cone, Torus, *others)
