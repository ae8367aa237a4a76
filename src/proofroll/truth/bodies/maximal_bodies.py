"""Bodies of route 2: each separate in space, with the position of its centre of mass and an attitude.

A body that can only move in a plane has three coordinates, any other seven; joint coordinates do not occur.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import WORLD, Joint, Mechanism
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis
from proofroll.truth.numerics import scalars
from proofroll.truth.numerics.scalars import Scalar, add, clean, cross, dot, mul, plus, scaled, turned, turned_back

_PARALLEL = 1e-12  # cross product of axes of a planar mechanism up to which they are parallel
# Smallest over largest moment of inertia up to which a body is a rod or a point, given with the digits of a file.
_LIGHT = 1e-9
# Kinds whose motion leaves a plane; the first route has a list of its own.
_OUT_OF_PLANE = frozenset({JointKind.CYLINDRICAL, JointKind.UNIVERSAL, JointKind.SPHERICAL, JointKind.FREE})


@dataclass(frozen=True)
class BodyStart:
    """Initial state of a body: origin and velocity of its frame, rotation, angular velocity, all in world axes."""

    p: Array
    R: Rotation
    v: Array
    w: Array


@dataclass(frozen=True)
class BodyInScalars:
    """A body at one instant, in scalars: centre of mass, rotation (rows), velocity, angular velocity; world axes."""

    r: Sequence[Scalar]
    R: Sequence[Sequence[Scalar]]
    v: Sequence[Scalar]
    w: Sequence[Scalar]


AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
GROUND = BodyInScalars((0.0,) * 3, AXES, (0.0,) * 3, (0.0,) * 3)


class GeneralBody:
    """A body in space: coordinates (r, quaternion), velocities (v, ω in body axes).

    Attributes:
        mass_matrix: for its velocities, (6, 6).
        heavy: True if that is invertible: the body has a mass and is neither a point nor a rod.
    """

    nx, nu = 7, 6

    def __init__(self, mass: float, inertia: Array) -> None:
        self.mass, self.inertia = mass, [[float(x) for x in row] for row in inertia]
        low, _, high = np.linalg.eigvalsh(inertia)
        self.heavy = bool(mass > 0 and low > _LIGHT * high)
        self.mass_matrix = block_diag(mass * np.eye(3), inertia)

    def start(self, placed: BodyStart, com: Array) -> tuple[list[float], list[float]]:
        """Coordinates and velocities of a body from its initial state."""
        arm = placed.R.apply(com)
        attitude = placed.R.as_quat(scalar_first=True)
        velocity = placed.v + np.cross(placed.w, arm)
        return [*(placed.p + arm), *attitude], [*velocity, *placed.R.inv().apply(placed.w)]

    def view(self, x: Sequence[Scalar], u: Sequence[Scalar], _: Mapping[str, Any]) -> BodyInScalars:
        """Pose and velocities for coordinates x, with a unit quaternion, and velocities u."""
        R = scalars.of_quaternion(x[3:])
        return BodyInScalars(x[:3], R, u[:3], turned(R, u[3:]))

    def projected(self, view: BodyInScalars, force: Sequence[Scalar], moment: Sequence[Scalar]) -> list[Scalar]:
        """Generalised force along u, from a force and a moment about the centre of mass in world axes."""
        return [*force, *turned_back(view.R, moment)]

    def gyroscopic(self, u: Sequence[Scalar]) -> list[Scalar]:
        """Gyroscopic force along u: inertial force at u̇ = 0."""
        return [0.0, 0.0, 0.0, *scaled(-1.0, cross(u[3:], turned(self.inertia, u[3:])))]

    def rate(self, x: Sequence[Scalar], u: Sequence[Scalar]) -> list[Scalar]:
        """Rates ẋ of the coordinates."""
        return [*u[:3], *scalars.quaternion_rate(x[3:], u[3:])]


class Planar:
    """A body that moves in a plane: two coordinates of the centre of mass and an angle, and their rates.

    Args:
        mass, inertia: kg, kg m² about the centre of mass in body axes.
        plane: directions e1, e2 in the plane and its normal, as columns in world axes.
        com: a position of the centre of mass, m.
        R: rotation of the body at angle zero.
    """

    nx, nu = 3, 3

    def __init__(self, mass: float, inertia: Array, plane: Array, com: Array, R: Rotation) -> None:
        self.mass, self.zero = mass, R
        normal = plane[:, 2]
        moment = R.inv().apply(normal) @ inertia @ R.inv().apply(normal)
        self.heavy = bool(mass > 0 and moment > _LIGHT * np.abs(inertia).max())
        self.mass_matrix = np.diag([mass, mass, moment])
        self.plane = plane
        self._columns = [clean(column) for column in plane.T]
        self._height = clean(normal * (normal @ com))
        matrix, projector = R.as_matrix(), np.outer(normal, normal)
        around = np.cross(normal, np.eye(3)).T  # normal × each column
        self._parts = [
            [clean(row) for row in part] for part in (matrix - projector @ matrix, around @ matrix, projector @ matrix)
        ]

    def start(self, placed: BodyStart, com: Array) -> tuple[list[float], list[float]]:
        """Coordinates and velocities of a body from its initial state."""
        arm = placed.R.apply(com)
        angle = float((placed.R * self.zero.inv()).as_rotvec() @ self.plane[:, 2])
        velocity = placed.v + np.cross(placed.w, arm)
        e1, e2, normal = self.plane.T
        return [(placed.p + arm) @ e1, (placed.p + arm) @ e2, angle], [velocity @ e1, velocity @ e2, placed.w @ normal]

    def view(self, x: Sequence[Scalar], u: Sequence[Scalar], functions: Mapping[str, Any]) -> BodyInScalars:
        """Pose and velocities for coordinates x and velocities u."""
        c, s = functions["cos"](x[2]), functions["sin"](x[2])
        R = [
            [add(mul(c, a), mul(s, b), d) for a, b, d in zip(*rows, strict=True)]
            for rows in zip(*self._parts, strict=True)
        ]
        e1, e2, normal = self._columns
        r = plus(scaled(x[0], e1), scaled(x[1], e2), self._height)
        return BodyInScalars(r, R, plus(scaled(u[0], e1), scaled(u[1], e2)), scaled(u[2], normal))

    def projected(self, _: BodyInScalars, force: Sequence[Scalar], moment: Sequence[Scalar]) -> list[Scalar]:
        """Generalised force along u, from a force and a moment about the centre of mass in world axes."""
        e1, e2, normal = self._columns
        return [dot(force, e1), dot(force, e2), dot(moment, normal)]

    def gyroscopic(self, _: Sequence[Scalar]) -> list[Scalar]:
        """Gyroscopic force along u: zero in a plane."""
        return [0.0, 0.0, 0.0]

    def rate(self, _: Sequence[Scalar], u: Sequence[Scalar]) -> list[Scalar]:
        """Rates ẋ of the coordinates."""
        return list(u)


def placed_bodies(mechanism: Mechanism, at_zero: bool = False) -> dict[str, BodyStart]:
    """Initial states of all bodies, from the definition of the joints; ``at_zero``: at q = 0, v = 0."""
    placed = {WORLD: BodyStart(np.zeros(3), Rotation.identity(), np.zeros(3), np.zeros(3))}
    for joint in mechanism.joints:
        parent = placed[joint.parent]
        frame = parent.R * Rotation.from_euler("xyz", joint.orientation)
        q = np.zeros(joint.nq) if at_zero else np.array(joint.q0)
        v = np.zeros(joint.nv) if at_zero else np.array(joint.v0)
        # in the axes of A turned to the child's at q = 0
        shift, turn, slide, spin = _moved(joint, q, v)
        arm_on_parent = parent.R.apply(joint.position) + frame.apply(shift)
        R = frame * turn
        w = parent.w + frame.apply(spin)
        arm = -R.apply(joint.child_position)
        v_joint = parent.v + np.cross(parent.w, arm_on_parent) + frame.apply(slide)
        placed[joint.child] = BodyStart(parent.p + arm_on_parent + arm, R, v_joint + np.cross(w, arm), w)
    return placed


def _moved(joint: Joint, q: Array, v: Array) -> tuple[Array, Rotation, Array, Array]:
    """Shift, rotation, velocity and angular velocity of the child, in the axes that it has at q = 0."""
    none, unturned = np.zeros(3), Rotation.identity()
    e1, e2, e3 = joint.child_frame.copy().T
    if joint.kind == JointKind.REVOLUTE:
        return none, Rotation.from_rotvec(q[0] * e3), none, v[0] * e3
    if joint.kind in {JointKind.PRISMATIC, JointKind.CYLINDRICAL}:
        angle, spin = (0.0, 0.0) if joint.kind == JointKind.PRISMATIC else (q[1], v[1])
        return q[0] * e3, Rotation.from_rotvec(angle * e3), v[0] * e3, spin * e3
    if joint.kind == JointKind.UNIVERSAL:
        first_turn = Rotation.from_rotvec(q[0] * e3)
        return none, first_turn * Rotation.from_rotvec(q[1] * e1), none, v[0] * e3 + v[1] * first_turn.apply(e1)
    if joint.kind == JointKind.PLANAR:
        return q[0] * e1 + q[1] * e2, Rotation.from_rotvec(q[2] * e3), v[0] * e1 + v[1] * e2, v[2] * e3
    if joint.kind == JointKind.FIXED:
        return none, unturned, none, none
    turn = Rotation.from_quat(q[-4:], scalar_first=True) if q[-4:].any() else unturned
    shift, slide = (q[:3], turn.apply(v[:3])) if joint.kind == JointKind.FREE else (none, none)
    return shift, turn, slide, turn.apply(v[-3:])


def made_bodies(mechanism: Mechanism, allow_planar: bool) -> list[GeneralBody | Planar]:
    """Bodies of route 2; with ``allow_planar``, those of a planar mechanism have three coordinates."""
    plane = _plane(mechanism) if allow_planar else None
    if plane is None:
        return [GeneralBody(body.mass, np.array(body.inertia)) for body in mechanism.bodies]
    placed = placed_bodies(mechanism, at_zero=True)
    return [
        Planar(
            body.mass,
            np.array(body.inertia),
            plane,
            placed[body.name].p + placed[body.name].R.apply(body.com),
            placed[body.name].R,
        )
        for body in mechanism.bodies
    ]


def _plane(mechanism: Mechanism) -> Array | None:
    """Frame of the plane in which all bodies move, as columns with the normal last; None: they do not."""
    placed = placed_bodies(mechanism)
    axes = [(joint, placed[joint.child].R.apply(joint.child_frame[:, 2].copy())) for joint in mechanism.joints]
    normals = [axis for joint, axis in axes if joint.kind in {JointKind.REVOLUTE, JointKind.PLANAR}]
    if not normals or any(joint.kind in _OUT_OF_PLANE for joint in mechanism.joints):
        return None
    normal = normals[0]
    for joint, axis in axes:
        skewness = axis @ normal if joint.kind == JointKind.PRISMATIC else np.abs(np.cross(axis, normal)).max()
        if joint.kind != JointKind.FIXED and abs(skewness) > _PARALLEL:
            return None
    return frame_of_axis(normal)
