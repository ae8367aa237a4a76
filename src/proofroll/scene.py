"""What is simulated: bodies, surfaces, contacts, gravity and initial motion, frozen and typed.

A scene knows nothing of engines. Engines ask it for :attr:`Scene.rolling` (a ball on a surface) and compare
:attr:`Scene.requires` with what they provide.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from proofroll.bounds import OutOfBounds, bounded
from proofroll.errors import InputError
from proofroll.surfaces import AnySurface, FloatArray, Surface


class Capability(StrEnum):
    """What a scene may need and an engine may provide; the value is what a person reads."""

    ROLLING = "rolling without slip"
    CURVED_SURFACE = "a curved surface"
    ROLLING_RESISTANCE = "rolling resistance"
    BOUNDED_FRICTION = "bounded friction (slip)"
    ORIENTATION = "the ball's orientation"


# What may be asked for besides the motion, and what an engine must then be able to give.
ASKED: Mapping[str, Capability] = {"orientation": Capability.ORIENTATION}


@dataclass(frozen=True)
class Ball:
    """A rigid ball whose central inertia is the same about every axis.

    Attributes:
        radius: a [m].
        mass: m [kg].
        inertia_ratio: J / (m a²); 2/5 for a homogeneous ball, 2/3 for a thin shell.
    """

    name: str
    radius: float = field(metadata={"unit": "m"})
    mass: float = field(metadata={"unit": "kg"})
    inertia_ratio: float = field(default=0.4, metadata={"unit": "1"})
    shape: Literal["ball"] = "ball"

    def __post_init__(self) -> None:
        """Refuses what no ball has.

        Raises:
            OutOfBounds: a radius, mass or inertia that is not positive and finite.
        """
        for name in ("radius", "mass", "inertia_ratio"):
            bounded(name, getattr(self, name), above=0)

    @property
    def inertia(self) -> float:
        """J: central moment of inertia [kg m²]."""
        return self.inertia_ratio * self.mass * self.radius**2


@dataclass(frozen=True)
class Contact:
    """A ball that rolls on a surface.

    Attributes:
        rolling_resistance: f, distance by which the normal force is shifted forward [m].
        mu_static: largest |F|/N while sticking [-]; inf: the ball never slips.
        mu_kinetic: |F|/N while slipping [-].
    """

    body: str
    surface: str
    rolling_resistance: float = field(default=0.0, metadata={"unit": "m"})
    mu_static: float = field(default=math.inf, metadata={"unit": "1"})
    mu_kinetic: float = field(default=math.inf, metadata={"unit": "1"})

    def __post_init__(self) -> None:
        """Refuses what is no law of contact.

        Raises:
            OutOfBounds: a negative number, or more friction while slipping than while sticking.
        """
        bounded("rolling_resistance", self.rolling_resistance, at_least=0)
        bounded("mu_static", self.mu_static, at_least=0, unbounded=True)
        bounded("mu_kinetic", self.mu_kinetic, at_least=0, unbounded=True)
        if self.mu_kinetic > self.mu_static:
            raise OutOfBounds(
                "mu_kinetic", self.mu_kinetic, f"the value must be at most mu_static = {self.mu_static:g}"
            )


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity: magnitude [m/s²] and direction (any length)."""

    magnitude: float = field(metadata={"unit": "m/s^2"})
    direction: tuple[float, float, float] = field(default=(0.0, 0.0, -1.0), metadata={"unit": "1"})

    def __post_init__(self) -> None:
        """Refuses what is no gravity.

        Raises:
            OutOfBounds: a negative magnitude, or a direction without length.
        """
        bounded("magnitude", self.magnitude, at_least=0)
        for value in self.direction:
            bounded("direction", value)
        bounded("length of direction", math.hypot(*self.direction), above=0)


@dataclass(frozen=True)
class InitialMotion:
    """Rolling without slip at time 0.

    Attributes:
        coordinates: where on the surface, in its coordinates.
        velocity: of the centre along e2 and e3 [m/s]; the spin about e2 and e3 follows from rolling.
        spin: ω1, about the normal e1 [rad/s].
    """

    body: str
    coordinates: tuple[float, float] = (0.0, 0.0)
    velocity: tuple[float, float] = field(default=(0.0, 0.0), metadata={"unit": "m/s"})
    spin: float = field(default=0.0, metadata={"unit": "rad/s"})

    def __post_init__(self) -> None:
        """Refuses what is no number.

        Raises:
            OutOfBounds: a value that is not finite.
        """
        for name in ("coordinates", "velocity"):
            for value in getattr(self, name):
                bounded(name, value)
        bounded("spin", self.spin)


@dataclass(frozen=True)
class RollingBall:
    """A ball on a surface as every engine needs it: one body, one contact, and where it starts.

    Attributes:
        ball: the body.
        contact: the contact law.
        surface: the surface on which the ball's *centre* moves.
        wall: the surface that the ball touches.
        gravity: acceleration of gravity in the world [m/s²], shape (3,).
        u0: initial surface coordinates, shape (2,).
        p0, v0, w0: initial centre [m], velocity [m/s] and angular velocity [rad/s] in the world, shape (3,).
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

    @property
    def udot0(self) -> FloatArray:
        """Initial rates of the surface coordinates, shape (2,)."""
        return np.asarray(np.linalg.pinv(self.surface.tangents(self.u0)) @ self.v0)


@dataclass(frozen=True)
class Scene:
    """One mechanical problem.

    Attributes:
        name: folder name under ``models/``.
        title: one line for a person.
        balls, surfaces, contacts, gravity, initial: the mechanics.
        parameters: the numbers a user can set by name, SI units.
        folder: where the scene's file and its engine-native models lie.
        asks: what is wanted besides the motion, names of :data:`ASKED`; what nobody asks for need not be modelled.
    """

    name: str
    title: str
    balls: tuple[Ball, ...]
    surfaces: tuple[AnySurface, ...]
    contacts: tuple[Contact, ...]
    gravity: Gravity
    initial: tuple[InitialMotion, ...]
    parameters: Mapping[str, float] = field(default_factory=dict)
    folder: Path = Path()
    asks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuses what cannot be asked for.

        Raises:
            InputError: something else than the names of :data:`ASKED`.
        """
        for name in self.asks:
            if name not in ASKED:
                raise InputError("asks", name, f"there is nothing of that name to ask for; choose {', '.join(ASKED)}")

    @property
    def requires(self) -> frozenset[Capability]:
        """What an engine must be able to represent; no more than the scene needs."""
        needs = {Capability.ROLLING, *(ASKED[name] for name in self.asks)}
        for contact in self.contacts:
            if contact.rolling_resistance > 0:
                needs.add(Capability.ROLLING_RESISTANCE)
            if math.isfinite(contact.mu_static):
                needs.add(Capability.BOUNDED_FRICTION)
        if any(surface.kind != "plane" for surface in self.surfaces):
            needs.add(Capability.CURVED_SURFACE)
        return frozenset(needs)

    @cached_property
    def rolling(self) -> RollingBall:
        """The scene's one ball on its one surface.

        Raises:
            InputError: the scene is not one ball on one surface.
        """
        if not len(self.balls) == len(self.surfaces) == len(self.contacts) == len(self.initial) == 1:
            raise InputError("scene", self.name, "so far a scene holds one ball on one surface")
        ball, wall, contact, start = self.balls[0], self.surfaces[0], self.contacts[0], self.initial[0]
        surface = wall.offset(ball.radius)
        direction = np.asarray(self.gravity.direction, dtype=np.float64)
        u0 = np.asarray(start.coordinates, dtype=np.float64)
        frame = surface.frame(u0)
        v0 = frame[:, 1:] @ np.asarray(start.velocity)
        w0 = start.spin * frame[:, 0] - np.cross(frame[:, 0], v0) / ball.radius
        return RollingBall(
            ball=ball,
            contact=contact,
            surface=surface,
            wall=wall,
            gravity=self.gravity.magnitude * direction / np.linalg.norm(direction),
            u0=u0,
            p0=surface.position(u0),
            v0=v0,
            w0=w0,
        )

    @cached_property
    def digest(self) -> str:
        """Hash of everything that decides the result: the mechanics, what is asked, and the engine-native files."""
        left_out = {"title", "folder", "parameters"} | (set() if self.asks else {"asks"})
        content = {key: value for key, value in asdict(self).items() if key not in left_out}
        found = hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode())
        if self.folder != Path():
            for file in sorted(self.folder.iterdir()):
                if file.is_file() and file.suffix not in {".toml", ".md"}:
                    found.update(file.name.encode() + file.read_bytes())
        return found.hexdigest()[:16]
