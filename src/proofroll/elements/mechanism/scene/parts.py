"""Bodies, loops, springs, applied forces and tracked points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from proofroll.core.arrays import read_only
from proofroll.core.errors import InputError, require_known
from proofroll.elements.mechanism.scene import checks, rotations
from proofroll.elements.mechanism.scene.checks import METRES, RADIANS, RATIO, WORLD, ZERO, Inertia, Vector, Z
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, LOOP_FACTS, JointKind, LoopKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, Formula, Table, checked, value_at
from proofroll.elements.mechanism.scene.spring_law import SpringLaw

ForceKind = Literal["force", "moment"]
Axes = Literal["world", "body"]
_ROUND_OFF = 1e-12  # relative to the places of its points: a shorter distance has no direction
_LOAD: Mapping[str, Any] = {"unit": {"force": "N", "moment": "N m"}, "signal": True}


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
        kind: kind of joint whose constraints it has, any but free; or ``distance``, a strut without mass.
        body_a, body_b: names of bodies, or ``world``.
        position_a, position_b: the point of each body that the loop holds together, in its frame [m].
        axis_a, axis_b: axis in the frame of each body; revolute, planar: parallel; universal: perpendicular;
            prismatic: ``axis_a`` alone.
        orientation: roll, pitch, yaw of body_b's frame against body_a's, held by fixed and prismatic loops [rad].
        length: distance of the points that a ``distance`` holds [m].
    """

    name: str
    kind: LoopKind
    body_a: str
    body_b: str
    position_a: Vector = field(default=ZERO, metadata=METRES)
    position_b: Vector = field(default=ZERO, metadata=METRES)
    axis_a: Vector = field(default=Z, metadata=RATIO)
    axis_b: Vector = field(default=Z, metadata=RATIO)
    orientation: Vector = field(default=ZERO, metadata=RADIANS)
    length: float = field(default=0.0, metadata=METRES)

    def __post_init__(self) -> None:
        where = f"loops.{checks.name(self.name, 'loops')}"
        require_known(f"{where}.kind", self.kind, LOOP_FACTS)
        if self.kind != DISTANCE:
            checks.assign(self, kind=JointKind(self.kind))
        if self.kind == JointKind.FREE:
            raise InputError(f"{where}.kind", self.kind, "a free loop holds nothing; remove it")
        if self.body_a == self.body_b:
            raise InputError(f"{where}.body_b", self.body_b, "a loop connects two bodies; these are the same")
        checks.read(self, where, checks.vector, "position_a", "position_b", "orientation")
        checks.read(self, where, checks.axis, "axis_a", "axis_b")
        checks.read(self, where, checks.number, "length", at_least=0)
        if (self.kind == DISTANCE) != (self.length > 0):
            advice = "a distance loop needs one" if self.kind == DISTANCE else f"a {self.kind} loop has none; remove it"
            raise InputError(f"{where}.length", self.length, advice)
        size = max(map(abs, (*self.position_a, *self.position_b)))
        if 0 < self.length <= _ROUND_OFF * size:
            advice = "its points are one within rounding; take a spherical loop"
            raise InputError(f"{where}.length", self.length, advice)

    @cached_property
    def frame_a(self) -> Array:
        """Axes of the loop's frame on body_a, in that body's axes, as columns; z is the axis."""
        return read_only(rotations.frame_of_axis(self.axis_a))

    @cached_property
    def frame_b(self) -> Array:
        """Axes of the loop's frame B on body_b, as columns; with :attr:`frame_a` as A it obeys the rows of a joint."""
        if self.kind in {JointKind.FIXED, JointKind.PRISMATIC}:
            return read_only(rotations.from_rpy(self.orientation).T @ self.frame_a)
        if self.kind == JointKind.UNIVERSAL:  # the joint's row is: z of A perpendicular to x of B
            return read_only(rotations.frame_of_axis(self.axis_b)[:, [2, 0, 1]])
        return read_only(rotations.frame_of_axis(self.axis_b))


@dataclass(frozen=True)
class Spring:
    """A straight spring and damper between two points; it pulls with stiffness·(L − length) + damping·L̇ + force.

    Attributes:
        name: unique among springs.
        body_a, body_b: names of bodies, or ``world``.
        position_a, position_b: its ends in the frame of each body [m].
        stiffness: of the pull along the line [N/m].
        damping: of the pull along the line [N s/m].
        length: free length, at which stiffness does not pull [m].
        force: further pull as a formula of the length L [m] and its rate dL [m/s]: ``"= 80*(L - 0.3)^3"``.
    """

    name: str
    body_a: str
    body_b: str
    position_a: Vector = field(default=ZERO, metadata=METRES)
    position_b: Vector = field(default=ZERO, metadata=METRES)
    stiffness: float = field(default=0.0, metadata={"unit": "N/m"})
    damping: float = field(default=0.0, metadata={"unit": "N s/m"})
    length: float = field(default=0.0, metadata=METRES)
    force: SpringLaw | None = field(default=None, metadata={"unit": "N", "law": True})

    def __post_init__(self) -> None:
        where = f"springs.{checks.name(self.name, 'springs')}"
        if self.body_a == self.body_b:
            raise InputError(f"{where}.body_b", self.body_b, "a spring connects two bodies; these are the same")
        checks.read(self, where, checks.vector, "position_a", "position_b")
        checks.read(self, where, checks.number, "stiffness", "damping", "length", at_least=0)

    @property
    def stiffest(self) -> float:
        """Stiffness along its line [N/m]."""
        return self.stiffness

    def pull(self, length: Any, rate: Any, functions: Mapping[str, Callable[..., Any]] = FUNCTIONS) -> Any:
        """Pull on both ends for a length [m] and its rate [m/s], N; numbers or arrays."""
        pull = self.stiffness * (length - self.length) + self.damping * rate
        return pull if self.force is None else pull + self.force.pull(length, rate, functions, self.name)


@dataclass(frozen=True)
class Force:
    """A force or a moment that acts on a body from outside, or between two bodies.

    Attributes:
        name: unique among forces.
        body: the body on which it acts.
        kind: a force [N] or a moment [N m].
        value: three components, each a number or a formula ``"= 2*sin(t)"``; or a table of times and values.
        position: place of the body on which a force acts, in its frame [m].
        frame: axes of the components: ``world``, or ``body``, so that the force turns with the body.
        reaction: second body, on which the opposite force acts at the same place; the world feels none.
    """

    name: str
    body: str
    kind: ForceKind
    value: tuple[float | Formula | Table, float | Formula | Table, float | Formula | Table] = field(metadata=_LOAD)
    position: Vector = field(default=ZERO, metadata=METRES)
    frame: Axes = "world"
    reaction: str = WORLD

    def __post_init__(self) -> None:
        where = f"forces.{checks.name(self.name, 'forces')}"
        require_known(f"{where}.kind", self.kind, ("force", "moment"))
        require_known(f"{where}.frame", self.frame, ("world", "body"))
        if self.body == WORLD:
            raise InputError(f"{where}.body", WORLD, "a force on the world moves nothing; name a body")
        if self.body == self.reaction:
            raise InputError(f"{where}.reaction", self.reaction, "the force and its reaction cancel; name another body")
        checks.read(self, where, checks.vector, "position")
        if self.kind == "moment" and any(self.position):
            raise InputError(f"{where}.position", self.position, "a moment has no place; leave it out")
        if not isinstance(self.value, tuple | list) or len(self.value) != 3:
            raise InputError(f"{where}.value", self.value, "give three components")
        parts = tuple(checked(f"{where}.value.{number}", part) for number, part in enumerate(self.value))
        checks.assign(self, value=parts)

    def at(self, time: Any, functions: Mapping[str, Callable[[Any], Any]] = FUNCTIONS) -> list[Any]:
        """Components at a time [s], which may be a symbol if ``functions`` evaluates calls for it [N or N m]."""
        return [value_at(part, time, functions) for part in self.value]


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
