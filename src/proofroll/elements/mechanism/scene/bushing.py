"""Bushings: springs and dampers along and about three axes between frames of two bodies.

Rotations are measured by the rotation vector, whose moment is the derivative of an energy (Chirikjian, Stochastic
Models, Information Theory, and Lie Groups 2, 2012, section 10.3: Jacobian of the exponential).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import read_only
from proofroll.core.errors import InputError
from proofroll.core.parameters import Unit
from proofroll.elements.mechanism.scene import checks, rotations
from proofroll.elements.mechanism.scene.checks import METRES, RADIANS, ZERO, Vector
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array, cross

if TYPE_CHECKING:
    from proofroll.elements.mechanism.scene.joint import Joint

Six = tuple[float, float, float, float, float, float]
NONE: Six = (0.0,) * 6
# Largest rotation [rad]: at half a turn the rotation vector is not unique, and its moment jumps.
LARGEST = 3.0
_SAME = 1e-12  # components of two rotations up to which they are the same: round-off of angles
_SMALL = 0.03  # rad, below which a series has more digits than the quotient
SIX_STIFFNESSES: tuple[Unit, ...] = ("N/m",) * 3 + ("N m/rad",) * 3
SIX_DAMPINGS: tuple[Unit, ...] = ("N s/m",) * 3 + ("N m s/rad",) * 3


@dataclass(frozen=True)
class Bushing:
    """Springs and dampers along and about the axes of a frame A on body_a; they act on a frame B on body_b.

    Along each axis of A, B's origin is pulled back to that of A. About the axes, the rotation vector θ of B in A
    (components along A, below 3 rad) has the energy ½ Σ k θ²; the moment is its derivative, for one axis alone -k θ.
    Dampers act on the rate of the distance seen in A, and on the relative angular velocity.

    Attributes:
        name: unique among bushings.
        body_a, body_b: names of bodies, or ``world``.
        position_a, position_b: origins of frames A and B in the frame of each body [m].
        orientation_a, orientation_b: roll, pitch, yaw of A and B in the frame of each body [rad]; without load A and B
            coincide.
        stiffness: along x, y, z, then about x, y, z of A.
        damping: likewise.
    """

    name: str
    body_a: str
    body_b: str
    position_a: Vector = field(default=ZERO, metadata=METRES)
    position_b: Vector = field(default=ZERO, metadata=METRES)
    orientation_a: Vector = field(default=ZERO, metadata=RADIANS)
    orientation_b: Vector = field(default=ZERO, metadata=RADIANS)
    stiffness: Six = field(default=NONE, metadata={"unit": SIX_STIFFNESSES})
    damping: Six = field(default=NONE, metadata={"unit": SIX_DAMPINGS})

    def __post_init__(self) -> None:
        place = f"bushings.{checks.name(self.name, 'bushings')}"
        if self.body_a == self.body_b:
            raise InputError(f"{place}.body_b", self.body_b, "a bushing connects two bodies; these are the same")
        checks.read(self, place, checks.vector, "position_a", "position_b", "orientation_a", "orientation_b")
        for key in ("stiffness", "damping"):
            checks.assign(self, **{key: checks.numbers(f"{place}.{key}", getattr(self, key), 6, at_least=0)})

    @property
    def stiffest(self) -> float:
        """Largest stiffness along an axis [N/m]."""
        return max(self.stiffness[:3])

    @cached_property
    def frame_a(self) -> Array:
        """Axes of A in the axes of body_a, as columns."""
        return read_only(rotations.from_rpy(self.orientation_a))

    @cached_property
    def frame_b(self) -> Array:
        """Axes of B in the axes of body_b, as columns."""
        return read_only(rotations.from_rpy(self.orientation_b))

    def is_spring_of(self, joint: Joint) -> bool:
        """True if this is a spring alone of a ball joint, at rest at q = 0 and the same in all directions."""
        ends = (self.body_a, self.position_a, self.body_b, self.position_b)
        there = ends == (joint.parent, joint.position, joint.child, joint.child_position)
        alike = len(set(self.stiffness[3:])) == 1 and not any(self.stiffness[:3] + self.damping)
        if joint.kind != JointKind.SPHERICAL or not there or not alike:
            return False
        at_rest = joint.parent_frame @ joint.child_frame.T - self.frame_a @ self.frame_b.T
        return bool(np.abs(at_rest).max() <= _SAME)

    def load(self, R_a: Array, R_b: Array, apart: Array, slide: Array, w_a: Array, w_b: Array) -> tuple[Array, Array]:
        """Force [N] and moment [N m] on body_b at the origin of B; the opposite acts on body_a at the same place.

        Everything is along the axes of the world.

        Args:
            R_a: rotation of body_a.
            R_b: rotation of body_b.
            apart: from the origin of A to that of B [m].
            slide: velocity of the origin of B minus that of the origin of A [m/s].
            w_a: angular velocity of body_a [rad/s].
            w_b: angular velocity of body_b [rad/s].
        """
        A = R_a @ self.frame_a
        k, c = np.array(self.stiffness), np.array(self.damping)
        force, moment = -k[:3] * (A.T @ apart), -c[3:] * (A.T @ (w_b - w_a))
        if any(self.damping[:3]):
            force = force - c[:3] * (A.T @ (slide - cross(w_a, apart)))
        if any(self.stiffness[3:]):
            moment = moment - _gradient(A.T @ R_b @ self.frame_b, k[3:])
        return A @ force, A @ moment

    def turned(self, R_a: Array, R_b: Array) -> float:
        """Angle of the rotation of B in A [rad], 0 without stiffness about axes; ``R_a``, ``R_b``: of the bodies."""
        if not any(self.stiffness[3:]):
            return 0.0
        return angle_of((R_a @ self.frame_a).T @ R_b @ self.frame_b)[0]


def angle_of(R: Array) -> tuple[float, Array]:
    """Angle [rad] and rotation vector of a rotation by less than half a turn."""
    turn = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = math.sqrt(float(turn @ turn))
    angle = math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0))
    return angle, turn * (angle / sine if sine > 0.0 else 1.0)


def _gradient(R: Array, stiffness: Array) -> Array:
    """Derivative of ½ Σ k θ² by a rotation of B about the axes of A, N m."""
    angle, theta = angle_of(R)
    if angle < _SMALL:
        factor = 1 / 12 + angle**2 / 720 + angle**4 / 30240
    else:
        factor = (1.0 - 0.5 * angle / math.tan(0.5 * angle)) / angle**2
    moment = stiffness * theta
    across = cross(theta, moment)
    gradient: Array = moment + 0.5 * across + factor * cross(theta, across)
    return gradient
