"""Tables of a scene file that describe balls on walls: a ball, the law of its contact, its start."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from proofroll.core.bounds import OutOfBounds, require_bounds
from proofroll.elements.mechanism.scene.checks import Against


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
        against: law of that resistance while the ball slips: the ``motion`` of its centre, or its ``turning``.
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
    against: Against = "motion"
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
