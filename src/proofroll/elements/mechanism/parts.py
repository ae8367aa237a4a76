"""Bodies, loops, springs and tracked points."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from proofroll.core.arrays import read_only
from proofroll.core.errors import InputError, require_known
from proofroll.elements.mechanism import checks, rotations
from proofroll.elements.mechanism.checks import METRES, RADIANS, RATIO, WORLD, ZERO, Inertia, Vector, Z
from proofroll.elements.mechanism.joint import FACTS, Kind
from proofroll.elements.mechanism.rotations import Array


@dataclass(frozen=True)
class Body:
    """A rigid body.

    Attributes:
        name: unique in the mechanism.
        mass: of the body [kg].
        com: centre of mass in the body's frame [m].
        inertia: 3×3 about the centre of mass, in the body's axes [kg m²]; may be given as three principal moments.
    """

    name: str
    mass: float = field(metadata={"unit": "kg"})
    com: Vector = field(default=ZERO, metadata=METRES)
    inertia: Inertia = field(default=(ZERO, ZERO, ZERO), metadata={"unit": "kg m^2"})

    def __post_init__(self) -> None:
        where = f"bodies.{checks.name(self.name, 'bodies')}"
        if self.name == WORLD:
            raise InputError("bodies.name", WORLD, "this name means the world; choose another")
        inertia = checks.inertia(f"{where}.inertia", self.inertia)
        if checks.number(f"{where}.mass", self.mass, at_least=0) == 0 and np.any(inertia):
            raise InputError(f"{where}.inertia", self.inertia, "a body without mass has no inertia; give it a mass")
        checks.assign(self, mass=float(self.mass), com=checks.vector(f"{where}.com", self.com), inertia=inertia)


@dataclass(frozen=True)
class Loop:
    """A connection between two bodies of the tree that closes a loop; it has the kinds of joints, but no coordinates.

    Its wrench acts on ``body_b``, as that of a joint acts on its child.

    Attributes:
        name: unique among joints and loops.
        kind: kind of joint whose constraints it has; any but free.
        body_a, body_b: names of bodies, or ``world``.
        position_a, position_b: the point of each body that the loop holds together, in its frame [m].
        axis_a, axis_b: axis in the frame of each body; revolute, planar: parallel; universal: perpendicular;
            prismatic: ``axis_a`` alone.
        orientation: roll, pitch, yaw of body_b's frame against body_a's, held by fixed and prismatic loops [rad].
    """

    name: str
    kind: Kind
    body_a: str
    body_b: str
    position_a: Vector = field(default=ZERO, metadata=METRES)
    position_b: Vector = field(default=ZERO, metadata=METRES)
    axis_a: Vector = field(default=Z, metadata=RATIO)
    axis_b: Vector = field(default=Z, metadata=RATIO)
    orientation: Vector = field(default=ZERO, metadata=RADIANS)

    def __post_init__(self) -> None:
        where = f"loops.{checks.name(self.name, 'loops')}"
        require_known(f"{where}.kind", self.kind, FACTS)
        if self.kind == "free":
            raise InputError(f"{where}.kind", self.kind, "a free loop holds nothing; remove it")
        if self.body_a == self.body_b:
            raise InputError(f"{where}.body_b", self.body_b, "a loop connects two bodies; these are the same")
        checks.read(self, where, checks.vector, "position_a", "position_b", "orientation")
        checks.read(self, where, checks.axis, "axis_a", "axis_b")

    @cached_property
    def frame_a(self) -> Array:
        """Axes of the loop's frame on body_a, in that body's axes, as columns; z is the axis."""
        return read_only(rotations.frame_of_axis(self.axis_a))

    @cached_property
    def frame_b(self) -> Array:
        """Axes of the loop's frame B on body_b, as columns; with :attr:`frame_a` as A it obeys the rows of a joint."""
        if self.kind in {"fixed", "prismatic"}:
            return read_only(rotations.from_rpy(self.orientation).T @ self.frame_a)
        if self.kind == "universal":  # the joint's row is: z of A perpendicular to x of B
            return read_only(rotations.frame_of_axis(self.axis_b)[:, [2, 0, 1]])
        return read_only(rotations.frame_of_axis(self.axis_b))


@dataclass(frozen=True)
class Spring:
    """A straight spring and damper between two points; it pulls with stiffness·(L − length) + damping·L̇.

    Attributes:
        name: unique among springs.
        body_a, body_b: names of bodies, or ``world``.
        position_a, position_b: its ends in the frame of each body [m].
        stiffness: of the pull along the line [N/m].
        damping: of the pull along the line [N s/m].
        length: free length, at which the spring does not pull [m].
    """

    name: str
    body_a: str
    body_b: str
    position_a: Vector = field(default=ZERO, metadata=METRES)
    position_b: Vector = field(default=ZERO, metadata=METRES)
    stiffness: float = field(default=0.0, metadata={"unit": "N/m"})
    damping: float = field(default=0.0, metadata={"unit": "N s/m"})
    length: float = field(default=0.0, metadata=METRES)

    def __post_init__(self) -> None:
        where = f"springs.{checks.name(self.name, 'springs')}"
        if self.body_a == self.body_b:
            raise InputError(f"{where}.body_b", self.body_b, "a spring connects two bodies; these are the same")
        checks.read(self, where, checks.vector, "position_a", "position_b")
        checks.read(self, where, checks.number, "stiffness", "damping", "length", at_least=0)


@dataclass(frozen=True)
class Point:
    """A point of a body that is tracked.

    Attributes:
        name: unique among points.
        body: name of its body, or ``world``.
        position: in the body's frame [m].
    """

    name: str
    body: str
    position: Vector = field(default=ZERO, metadata=METRES)

    def __post_init__(self) -> None:
        where = f"points.{checks.name(self.name, 'points')}"
        checks.read(self, where, checks.vector, "position")
