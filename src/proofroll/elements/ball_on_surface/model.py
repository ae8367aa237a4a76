"""A ball, the surface that it touches, the law of their contact, and the ball's start."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Literal

import numpy as np

from proofroll.core.arrays import FloatArray, read_only
from proofroll.core.bounds import OutOfBounds, require_bounds
from proofroll.elements.ball_on_surface.surfaces import Surface


class BallCapability(StrEnum):
    """Capability that a ball on a surface may need of a formulation; the value is a text for a person."""

    ROLLING = "rolling without slip"
    CURVED_SURFACE = "a curved surface"
    ROLLING_RESISTANCE = "rolling resistance"
    BOUNDED_FRICTION = "bounded friction (slip)"
    ORIENTATION = "the ball's orientation"
    SLIPPING_START = "a start that slips"
    MOVING_WALL = "a wall that moves"
    IMPACTS = "impacts on the wall (restitution)"
    TANGENTIAL_RESTITUTION = "restitution along the wall"


ROLLS: frozenset[str] = frozenset(
    {BallCapability.ROLLING, BallCapability.CURVED_SURFACE, BallCapability.ROLLING_RESISTANCE}
)
# Capabilities for a ball that stays on a wall at rest; few formulations have the others, and declare them themselves.
ALL_OF_A_BALL: frozenset[str] = frozenset(BallCapability) - {
    BallCapability.MOVING_WALL,
    BallCapability.IMPACTS,
    BallCapability.TANGENTIAL_RESTITUTION,
}


@dataclass(frozen=True)
class Ball:
    """A rigid ball with the same central inertia about every axis.

    Attributes:
        name: used by contacts and starts.
        radius: a [m].
        mass: m [kg].
        inertia_ratio: J / (m a²); 2/5 for a homogeneous ball, 2/3 for a thin shell.
        shape: of the body; only ``ball``.
    """

    name: str
    radius: float = field(metadata={"unit": "m"})
    mass: float = field(metadata={"unit": "kg"})
    inertia_ratio: float = field(default=0.4, metadata={"unit": "1"})
    shape: Literal["ball"] = "ball"

    def __post_init__(self) -> None:
        for name in ("radius", "mass", "inertia_ratio", "inertia"):
            require_bounds(name, getattr(self, name), above=0)

    @property
    def inertia(self) -> float:
        """J: central moment of inertia [kg m²]."""
        return self.inertia_ratio * self.mass * self.radius**2


@dataclass(frozen=True)
class Contact:
    """Contact law of a ball on a surface.

    Attributes:
        body, surface: names of a ball and of the surface that it touches.
        rolling_resistance: f, distance by which the normal force is shifted forward [m].
        mu_static: largest |F|/N while sticking [1]; inf: the ball never slips.
        mu_kinetic: |F|/N while slipping [1].
        restitution: e: normal speed after an impact over that before it [1]; left out: impacts are not modelled, and
            the motion is known only until the ball would land.
        tangential_restitution: e_t: the contact point leaves an impact with -e_t times its velocity along the wall, as
            far as friction allows [1]; 0: at rest, 1: fully reversed.
    """

    body: str
    surface: str
    rolling_resistance: float = field(default=0.0, metadata={"unit": "m"})
    mu_static: float = field(default=math.inf, metadata={"unit": "1"})
    mu_kinetic: float = field(default=math.inf, metadata={"unit": "1"})
    restitution: float | None = field(default=None, metadata={"unit": "1"})
    tangential_restitution: float = field(default=0.0, metadata={"unit": "1"})

    def __post_init__(self) -> None:
        require_bounds("rolling_resistance", self.rolling_resistance, at_least=0)
        require_bounds("mu_static", self.mu_static, at_least=0, unbounded=True)
        require_bounds("mu_kinetic", self.mu_kinetic, at_least=0, unbounded=True)
        for name, least in (("restitution", 0), ("tangential_restitution", -1)):
            value = getattr(self, name)
            if value is not None and not least <= value <= 1:
                raise OutOfBounds(name, value, f"the value must be between {least} and 1")
        if self.mu_kinetic > self.mu_static:
            raise OutOfBounds(
                "mu_kinetic", self.mu_kinetic, f"the value must be at most mu_static = {self.mu_static:g}"
            )


@dataclass(frozen=True)
class InitialMotion:
    """Start of a ball at time 0: rolling without slip, unless its spin is given.

    Attributes:
        body: name of a ball.
        coordinates: place on the surface, in the surface's coordinates.
        velocity: of the centre along e2 and e3 [m/s].
        spin: ω1, about the normal e1 [rad/s].
        tangential_spin: ω2 and ω3, about e2 and e3 [rad/s]; left out: those of rolling without slip. Rolling along e2
            with the speed V has ω3 = -V/a, along e3 ω2 = V/a; with anything else the ball starts slipping.
        gap: distance of the ball from the wall [m].
    """

    body: str
    coordinates: tuple[float, float] = (0.0, 0.0)
    velocity: tuple[float, float] = field(default=(0.0, 0.0), metadata={"unit": "m/s"})
    spin: float = field(default=0.0, metadata={"unit": "rad/s"})
    tangential_spin: tuple[float, float] | None = field(default=None, metadata={"unit": "rad/s"})
    gap: float = field(default=0.0, metadata={"unit": "m"})

    def __post_init__(self) -> None:
        for name in ("coordinates", "velocity", "tangential_spin"):
            for value in getattr(self, name) or ():
                require_bounds(name, value)
        require_bounds("spin", self.spin)
        require_bounds("gap", self.gap, at_least=0)


@dataclass(frozen=True)
class RollingBall:
    """A ball on a surface in the form that engines use: one body, one contact, and its start.

    Attributes:
        ball: the body.
        contact: the contact law.
        surface: the surface on which the ball's *centre* moves.
        wall: the surface that the ball touches.
        gravity: acceleration of gravity in the world [m/s²], shape (3,).
        u0: initial surface coordinates, shape (2,).
        p0, v0, w0: initial centre [m], velocity [m/s] and angular velocity [rad/s] in the world, shape (3,).
        slip0: initial velocity of the contact point in the world [m/s], shape (3,); exactly zero where the ball rolls
            or does not touch the wall.
        gap0: initial distance from the wall [m].
    """

    ball: Ball
    contact: Contact
    surface: Surface
    wall: Surface
    gravity: FloatArray
    u0: FloatArray
    p0: FloatArray
    v0: FloatArray
    w0: FloatArray
    slip0: FloatArray = field(default_factory=lambda: np.zeros(3))
    gap0: float = 0.0

    def __post_init__(self) -> None:
        """Keeps read-only copies of the arrays."""
        for name in ("gravity", "u0", "p0", "v0", "w0", "slip0"):
            object.__setattr__(self, name, read_only(np.array(getattr(self, name), dtype=np.float64)))

    @property
    def flies(self) -> bool:
        """True if the ball starts off the wall, or may leave it and land again."""
        return self.gap0 > 0 or self.contact.restitution is not None

    @cached_property
    def wall_rate(self) -> FloatArray | None:
        """Angular velocity W of the wall about the world's origin [rad/s], shape (3,); None: the wall is at rest."""
        return read_only(np.array(self.wall.wall_rate)) if any(self.wall.wall_rate) else None

    @property
    def udot0(self) -> FloatArray:
        """Initial rates of the surface coordinates, shape (2,)."""
        return np.asarray(np.linalg.pinv(self.surface.tangents(self.u0)) @ self.v0)

    def with_contact(
        self,
        *,
        mu_static: float | None = None,
        mu_kinetic: float | None = None,
        rolling_resistance: float | None = None,
    ) -> RollingBall:
        """Copy with other contact parameters; μk left out keeps its ratio to μs (1 if μs is 0 or inf)."""
        contact = self.contact
        if mu_static is not None:
            if mu_kinetic is None:
                bounded = math.isfinite(contact.mu_static) and contact.mu_static > 0
                mu_kinetic = mu_static * (contact.mu_kinetic / contact.mu_static if bounded else 1.0)
            contact = replace(contact, mu_static=mu_static, mu_kinetic=mu_kinetic)
        if rolling_resistance is not None:
            contact = replace(contact, rolling_resistance=rolling_resistance)
        return replace(self, contact=contact)

    def at_speed(self, speed: float) -> RollingBall:
        """Copy with another initial speed of the centre [m/s], the same direction and ω1; the ball rolls."""
        e1 = self.surface.normal(self.p0)
        v0 = speed * self.v0 / np.linalg.norm(self.v0)
        w0 = (self.w0 @ e1) * e1 - np.cross(e1, v0) / self.ball.radius
        return replace(self, v0=v0, w0=w0, slip0=np.zeros(3))
