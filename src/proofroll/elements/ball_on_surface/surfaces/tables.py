"""Tables of planes, bowls, cones and tori in a scene file; the general mechanics follows a ball on them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from proofroll.core.bounds import OutOfBounds, require_bounds


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
