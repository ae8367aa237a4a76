"""Loads on the bodies: gravity, applied forces, springs and bushings by their laws; others are added as stated."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.truth.check.laws.integrals import cross, dot, norm, of_angles, turned, turned_back
from proofroll.truth.check.laws.record import Array, BodyPoses
from proofroll.truth.check.laws.residuals import ROUND
from proofroll.truth.check.laws.scene import LawScene, velocity_at
from proofroll.truth.check.laws.signals import pull_by, value_of

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Spring
    from proofroll.elements.mechanism.scene.bushing import Bushing

_ARM = 1e-2  # part of the natural length by which a force turns at least, for sizes of moments
_SMALL = 0.03  # rad, below which a series has more digits than the quotient


class BodyLoads:
    """Forces on bodies at the points of pieces, moments about centres of mass, their sizes, and their power.

    Attributes:
        force, moment: on each body [N, N m], (pieces, points, bodies + 1, 3).
        force_size, moment_size: sums of the sizes of their parts.
        force_digits, moment_digits: effect of round-off of places by stiff springs.
        power: of all loads that are not constraints, without gravity [W].
        power_size: sum of the sizes of its parts.
    """

    def __init__(self, scene: LawScene, pieces: BodyPoses) -> None:
        self._scene, self._pieces = scene, pieces
        self._centres = scene.centres(pieces)[0]
        self.force, self.moment = np.zeros_like(pieces.p), np.zeros_like(pieces.p)
        sizes = np.zeros((4, *pieces.p.shape[:-1]))
        self.force_size, self.moment_size, self.force_digits, self.moment_digits = sizes
        self.power, self.power_size = np.zeros(pieces.time.shape), np.zeros(pieces.time.shape)
        gravity = np.array(scene.mechanism.gravity)
        self.force += scene.mass[:, None] * gravity
        self.force_size += scene.mass * np.linalg.norm(gravity)
        self._springs()
        self._bushings()
        self._applied()

    def add(self, body: int, place: Array, force: Array, moment: Array | float = 0.0) -> None:
        """Adds a force at a place, and a moment, on a body."""
        if body == len(self._scene.mass) - 1:
            return
        arm = place - self._centres[..., body, :]
        self.force[..., body, :] += force
        self.moment[..., body, :] += cross(arm, force) + moment
        self.force_size[..., body] += norm(force)
        reach = norm(arm) + _ARM * self._scene.length
        self.moment_size[..., body] += norm(force) * reach + norm(np.broadcast_to(moment, force.shape))

    def between(self, b: int, a: int, place: Array, force: Array, moment: Array | float = 0.0) -> None:
        """Adds a force at a place, and a moment, on body b, and the opposite on body a."""
        self.add(b, place, force, moment)
        self.add(a, place, -force, -np.asarray(moment))

    def works(self, power: Array, size: Array) -> None:
        """Adds the power of a load, and its size [W]."""
        self.power += power
        self.power_size += size

    def _stiff(self, body: int, stiffness: float, far: Array, turning: float = 0.0) -> None:
        """Takes what round-off of places ``far`` from the origin does to a body by stiffnesses."""
        force = ROUND * stiffness * (self._scene.length + far)
        self.force_digits[..., body] += force
        self.moment_digits[..., body] += force * self._scene.length + ROUND * turning

    def _springs(self) -> None:
        scene, pieces = self._scene, self._pieces
        for spring in scene.mechanism.springs:
            a, b = scene.index[spring.body_a], scene.index[spring.body_b]
            pull, rate, ends = spring_pull(scene, pieces, spring)
            length = norm(ends[1] - ends[0])
            direction = (ends[1] - ends[0]) / length[..., None]
            for body, end, sign in ((a, ends[0], 1.0), (b, ends[1], -1.0)):
                self.add(body, end, (sign * pull)[..., None] * direction)
                self._stiff(body, spring.stiffness, length + norm(end))
            self.works(-pull * rate, (np.abs(pull) + spring.stiffness * scene.length) * scene.speed)

    def _bushings(self) -> None:
        scene, pieces = self._scene, self._pieces
        for bushing in scene.mechanism.bushings:
            a, b = scene.index[bushing.body_a], scene.index[bushing.body_b]
            force, moment, slide, spin = bushing_load(scene, pieces, bushing)
            origin_b = spring_ends(scene, pieces, bushing)[1]
            stiffness = np.array(bushing.stiffness)
            self.between(b, a, origin_b, force, moment)
            for body in (a, b):
                self._stiff(body, stiffness[:3].max(), norm(origin_b), stiffness[3:].max())
            size = norm(force) * scene.speed + norm(moment) * scene.rate
            size = size + stiffness[:3].max() * scene.length * scene.speed + stiffness[3:].max() * scene.rate
            self.works(dot(force, slide) + dot(moment, spin), size)

    def _applied(self) -> None:
        scene, pieces = self._scene, self._pieces
        for item in scene.mechanism.forces:
            a, b = scene.index[item.body], scene.index[item.reaction]
            value = np.stack([value_of(part, pieces.time) for part in item.value], -1)
            if item.frame == "body":
                value = turned(pieces.R[..., a, :, :], value)
            place = pieces.p[..., a, :] + turned(pieces.R[..., a, :, :], np.array(item.position))
            if item.kind == "force":
                self.between(a, b, place, value)
                power = dot(value, velocity_at(pieces, a, place) - velocity_at(pieces, b, place))
            else:
                self.between(a, b, place, 0 * value, value)
                power = dot(value, pieces.w[..., a, :] - pieces.w[..., b, :])
            self.works(power, norm(value) * scene.speed)


def spring_ends(scene: LawScene, pieces: BodyPoses, link: Spring | Bushing) -> tuple[Array, Array]:
    """Ends of a spring or bushing on its bodies [m]."""
    a, b = (
        pieces.p[..., body, :] + turned(pieces.R[..., body, :, :], np.array(position))
        for body, position in ((scene.index[link.body_a], link.position_a), (scene.index[link.body_b], link.position_b))
    )
    return a, b


def spring_pull(scene: LawScene, pieces: BodyPoses, spring: Spring) -> tuple[Array, Array, tuple[Array, Array]]:
    """Pull of a spring [N], the rate of its length [m/s], and its ends [m]."""
    ends = spring_ends(scene, pieces, spring)
    length = norm(ends[1] - ends[0])
    speeds = [
        velocity_at(pieces, scene.index[body], end)
        for body, end in zip((spring.body_a, spring.body_b), ends, strict=True)
    ]
    rate = dot((ends[1] - ends[0]) / length[..., None], speeds[1] - speeds[0])
    pull = spring.stiffness * (length - spring.length) + spring.damping * rate
    return pull if spring.force is None else pull + pull_by(spring.force, length, rate), rate, ends


def bushing_load(scene: LawScene, pieces: BodyPoses, bushing: Bushing) -> tuple[Array, Array, Array, Array]:
    """Force and moment of a bushing on its second body [N, N m], velocity and spin of that seen from the first."""
    a, b = scene.index[bushing.body_a], scene.index[bushing.body_b]
    A = pieces.R[..., a, :, :] @ of_angles(np.array(bushing.orientation_a))
    B = pieces.R[..., b, :, :] @ of_angles(np.array(bushing.orientation_b))
    origin_a, origin_b = spring_ends(scene, pieces, bushing)
    slide = velocity_at(pieces, b, origin_b) - velocity_at(pieces, a, origin_b)
    spin = pieces.w[..., b, :] - pieces.w[..., a, :]
    stiffness, damping = np.array(bushing.stiffness), np.array(bushing.damping)
    force = -stiffness[:3] * turned_back(A, origin_b - origin_a) - damping[:3] * turned_back(A, slide)
    moment = -_bent(A.swapaxes(-1, -2) @ B, stiffness[3:]) - damping[3:] * turned_back(A, spin)
    return turned(A, force), turned(A, moment), slide, spin


def rotation_vector(R: Array) -> Array:
    """Axis times angle of a rotation by less than half a turn [rad]."""
    sine = 0.5 * np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1)
    size = norm(sine)
    angle = np.arctan2(size, 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1))
    return np.asarray(sine * np.where(size > 0, angle / np.where(size > 0, size, 1.0), 1.0)[..., None])


def _bent(R: Array, stiffness: Array) -> Any:
    """Derivative of ½ Σ k θ² by a rotation about the axes of A, θ being the rotation vector of B in A."""
    theta = rotation_vector(R)
    angle = norm(theta)
    large = np.where(angle > _SMALL, angle, 1.0)
    series = 1 / 12 + angle**2 / 720 + angle**4 / 30240
    factor = np.where(angle > _SMALL, 1 / large**2 - 1 / (2 * large * np.tan(large / 2)), series)
    moment = stiffness * theta
    across = cross(theta, moment)
    return moment + 0.5 * across + factor[..., None] * cross(theta, across)
