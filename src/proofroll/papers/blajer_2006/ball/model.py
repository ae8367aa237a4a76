"""A ball on its wall in the form that its own formulations use, and what they provide."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from proofroll.core.arrays import FloatArray, read_only
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.scene.balls import Ball, Contact
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder

_CAPABILITY = MechanismCapability
# What a formulation of one ball provides that rolls in an upright cylinder, without and with its orientation.
ROLLS: frozenset[str] = frozenset({
    _CAPABILITY.CONTACT, _CAPABILITY.SPHERES, _CAPABILITY.BORES, _CAPABILITY.UNBOUNDED_FRICTION,
    _CAPABILITY.TURNING_FRICTION,
})  # fmt: skip
ALL_OF_A_BALL: frozenset[str] = ROLLS | {_CAPABILITY.ORIENTATION}
# Why such a formulation has no other bodies.
NO_OTHER_BODIES: Mapping[str, str] = {
    _CAPABILITY.FREE: "it represents nothing but a ball that rolls without slip in an upright cylinder"
}


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
    """

    ball: Ball
    contact: Contact
    surface: UprightCylinder
    wall: UprightCylinder
    gravity: FloatArray
    u0: FloatArray
    p0: FloatArray
    v0: FloatArray
    w0: FloatArray

    def __post_init__(self) -> None:
        """Keeps read-only copies of the arrays."""
        for name in ("gravity", "u0", "p0", "v0", "w0"):
            object.__setattr__(self, name, read_only(np.array(getattr(self, name), dtype=np.float64)))

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
        return replace(self, v0=v0, w0=w0)
