"""Numbers of a mechanism as the law check needs them: natural sizes, frames of connections, masses, the tree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.integrals import cross, dot, frame_of, of_angles, turned
from proofroll.truth.check.laws.record import Array, BodyPoses
from proofroll.truth.check.laws.signals import value_of
from proofroll.truth.check.laws.surfaces import PairContact, contacts_of

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Mechanism
    from proofroll.elements.mechanism.scene.drives import Coupling

# Free directions of a joint, in the order of its coordinates: axes of A (on the first body) or B, number, if it turns.
FREE: dict[str, tuple[tuple[str, int, bool], ...]] = {
    JointKind.FIXED: (),
    JointKind.REVOLUTE: (("A", 2, True),),
    JointKind.PRISMATIC: (("A", 2, False),),
    JointKind.CYLINDRICAL: (("A", 2, False), ("A", 2, True)),
    JointKind.UNIVERSAL: (("A", 2, True), ("B", 0, True)),
    JointKind.PLANAR: (("A", 0, False), ("A", 1, False), ("A", 2, True)),
    JointKind.SPHERICAL: tuple(("B", axis, True) for axis in range(3)),
    JointKind.FREE: tuple(("B", axis, turns) for turns in (False, True) for axis in range(3)),
}
# Axes of A along which the points of a joint stay together (others: all three), and pairs of axes of A and B that stay
# perpendicular (others: none).
HELD_PLACES: dict[str, tuple[int, ...]] = {
    JointKind.PRISMATIC: (0, 1),
    JointKind.CYLINDRICAL: (0, 1),
    JointKind.PLANAR: (2,),
    JointKind.FREE: (),
}
_PARALLEL, _EQUAL = ((0, 2), (1, 2)), ((0, 1), (1, 2), (2, 0))
HELD_TURNS: dict[str, tuple[tuple[int, int], ...]] = {
    JointKind.FIXED: _EQUAL,
    JointKind.PRISMATIC: _EQUAL,
    JointKind.REVOLUTE: _PARALLEL,
    JointKind.CYLINDRICAL: _PARALLEL,
    JointKind.PLANAR: _PARALLEL,
    JointKind.UNIVERSAL: ((2, 0),),
}
_FAINT = 1e-3  # part of the natural force of a scene below which forces count as of that size


class JointFrames(NamedTuple):
    """A joint or loop: bodies a and b, places and frames in their axes; ``length``: of a loop that holds a distance."""

    name: str
    kind: str
    a: int
    b: int
    position_a: Array
    position_b: Array
    frame_a: Array
    frame_b: Array
    length: float = 0.0


class FreeAxis(NamedTuple):
    """A free direction of a joint at the points of pieces: a unit vector, the rate along it, and if it turns."""

    direction: Array
    rate: Array
    turns: bool


class PlacedFrames(NamedTuple):
    """A connection at the points of pieces: axes of A and B as columns, origins of both, and velocities of B in A."""

    A: Array
    B: Array
    origin_a: Array
    origin_b: Array
    slide: Array
    spin: Array

    def free(self, kind: str) -> list[FreeAxis]:
        """Free directions of a joint of a kind, in the order of its coordinates."""
        axes = [((self.A if frame == "A" else self.B)[..., axis], turns) for frame, axis, turns in FREE[kind]]
        return [FreeAxis(way, dot(self.spin if turns else self.slide, way), turns) for way, turns in axes]


class LawScene:
    """Numbers of a mechanism in SI units.

    Attributes:
        mechanism: the data.
        length, speed, rate, force: natural sizes [m, m/s, 1/s, N].
        faint: force below which forces count as of that size [N].
        connections: joints, then loops.
        contacts: in the order of pairs.
        mass, com, inertia: of all bodies and the world, which has none.
    """

    def __init__(self, mechanism: Mechanism, length: float, rate: float) -> None:
        """Takes the natural length [m] and rate [1/s]."""
        self.mechanism, self.length, self.rate, self.speed = mechanism, length, rate, length * rate
        self.mass = np.array([*(body.mass for body in mechanism.bodies), 0.0])
        pull = float(np.linalg.norm(mechanism.gravity))
        self.force = max(float(self.mass.sum()) * max(pull, length * rate**2), float(np.finfo(float).tiny))
        self.faint = _FAINT * self.force
        self.com = np.array([*(body.com for body in mechanism.bodies), (0.0, 0.0, 0.0)])
        self.inertia = np.array([*(np.array(body.inertia) for body in mechanism.bodies), np.zeros((3, 3))])
        self.index = {"world": len(mechanism.bodies)} | {body.name: k for k, body in enumerate(mechanism.bodies)}
        self.connections = self._connections()
        self.contacts: list[PairContact] = contacts_of(mechanism.geometries, mechanism.pairs, self.index)

    def _connections(self) -> list[JointFrames]:
        connections = []
        for joint in self.mechanism.joints:
            plain = joint.kind in {JointKind.FIXED, JointKind.SPHERICAL, JointKind.FREE}
            second = None if joint.second_axis is None else np.array(joint.second_axis)
            frame = np.eye(3) if plain else frame_of(np.array(joint.axis), second)
            ends = self.index[joint.parent], self.index[joint.child]
            places = np.array(joint.position), np.array(joint.child_position)
            rotation = of_angles(np.array(joint.orientation))
            connections.append(
                JointFrames(joint.name, str(joint.kind), *ends, *places, frame_a=rotation @ frame, frame_b=frame)
            )
        for loop in self.mechanism.loops:
            kind, frame = str(loop.kind), frame_of(np.array(loop.axis_a))
            frame_b = frame_of(np.array(loop.axis_b))
            if kind in {JointKind.FIXED, JointKind.PRISMATIC}:
                frame_b = of_angles(np.array(loop.orientation)).T @ frame
            elif kind == JointKind.UNIVERSAL:  # z of A stays perpendicular to x of B
                frame_b = frame_b[:, [2, 0, 1]]
            ends = self.index[loop.body_a], self.index[loop.body_b]
            places = np.array(loop.position_a), np.array(loop.position_b)
            connections.append(
                JointFrames(loop.name, kind, *ends, *places, frame_a=frame, frame_b=frame_b, length=loop.length)
            )
        return connections

    def placed(self, connection: JointFrames, pieces: BodyPoses) -> PlacedFrames:
        """A connection at the points of pieces."""
        a, b = connection.a, connection.b
        origin_a = pieces.p[..., a, :] + turned(pieces.R[..., a, :, :], connection.position_a)
        origin_b = pieces.p[..., b, :] + turned(pieces.R[..., b, :, :], connection.position_b)
        return PlacedFrames(
            A=pieces.R[..., a, :, :] @ connection.frame_a,
            B=pieces.R[..., b, :, :] @ connection.frame_b,
            origin_a=origin_a,
            origin_b=origin_b,
            # of both bodies at one place: seen from body a, the rate of their distance
            slide=velocity_at(pieces, b, origin_b) - velocity_at(pieces, a, origin_b),
            spin=pieces.w[..., b, :] - pieces.w[..., a, :],
        )

    def free(self, number: int, pieces: BodyPoses) -> list[FreeAxis]:
        """Free directions of a joint or loop, by its number, at the points of pieces."""
        connection = self.connections[number]
        return self.placed(connection, pieces).free(connection.kind)

    @staticmethod
    def terms(coupling: Coupling) -> tuple[list[tuple[str, float]], float]:
        """Joints and factors of a coupling whose sum is constant, the first 1, and that sum."""
        if coupling.joints:
            scale = coupling.coefficients[0]
            pairs = zip(coupling.joints, coupling.coefficients, strict=True)
            return [(name, factor / scale) for name, factor in pairs], coupling.offset / scale
        return [(coupling.joint_b, 1.0), (coupling.joint_a, -coupling.ratio)], coupling.offset

    def centres(self, pieces: BodyPoses) -> tuple[Array, Array]:
        """Centres of mass [m] and their velocities [m/s]."""
        arm = turned(pieces.R, self.com)
        return pieces.p + arm, pieces.v + cross(pieces.w, arm)


def velocity_at(pieces: BodyPoses, body: int, place: Array) -> Array:
    """Velocity of a body at places [m/s]."""
    return np.asarray(pieces.v[..., body, :] + cross(pieces.w[..., body, :], place - pieces.p[..., body, :]))


def motion_of(signal: Any, time: Array) -> Array:
    """Values of a prescribed motion; a table is joined by a spline of fifth order that begins and ends at rest."""
    if not hasattr(signal, "times"):
        return value_of(signal, time)
    from scipy.interpolate import make_interp_spline

    at_rest = [(1, 0.0), (2, 0.0)]
    spline = make_interp_spline(signal.times, signal.values, k=5, bc_type=(at_rest, at_rest))
    return np.asarray(spline(np.clip(time, signal.times[0], signal.times[-1])))
