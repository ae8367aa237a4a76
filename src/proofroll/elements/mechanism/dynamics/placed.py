"""Poses and velocities of everything in a mechanism at many times, derived from those of its bodies."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from proofroll.core.arrays import FloatArray, cross, on_turns, read_only
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.checks import ZERO
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import AXES, DISTANCE, FACTS, WITH_QUATERNION, JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import from_quaternion, to_quaternion

TURN = 2 * np.pi


@dataclass(frozen=True)
class Placed:
    """Motion of all bodies of a mechanism, and quantities derived from it.

    Attributes:
        mechanism: the mechanism that moves.
        time: [s], shape (time,).
        p_WB, v_WB, w_WB: of each body's frame in the world [m, m/s, rad/s], shape (time, bodies, 3).
        q_WB: unit quaternions, scalar first, shape (time, bodies, 4).
        known_q: coordinates of the tree where they were integrated, shape (time, nq); whole turns of angles are then
            counted from them. None: whole turns are counted from the rates at the samples.
    """

    mechanism: Mechanism
    time: FloatArray
    p_WB: FloatArray
    v_WB: FloatArray
    w_WB: FloatArray
    q_WB: FloatArray
    known_q: FloatArray | None = None

    def __post_init__(self) -> None:
        read_only((self.time, self.p_WB, self.v_WB, self.w_WB, self.q_WB, self.known_q))

    @cached_property
    def R_WB(self) -> FloatArray:
        """Rotations of the bodies, and of the world last, shape (time, bodies + 1, 3, 3)."""
        turned = np.moveaxis(from_quaternion(np.moveaxis(self.q_WB, -1, 0)), (0, 1), (-2, -1))
        world = np.broadcast_to(np.eye(3), (len(turned), 1, 3, 3))
        return read_only(np.concatenate([turned, world], 1))

    def point(self, body: str, position: Sequence[float]) -> FloatArray:
        """Position in the world of a point fixed to a body or to the world [m], shape (time, 3)."""
        index = self.mechanism.body_index[body]
        origin = np.zeros((len(self.time), 3)) if index < 0 else self.p_WB[:, index]
        return np.asarray(origin + self.R_WB[:, index] @ np.asarray(position, dtype=np.float64))

    def velocity(self, body: str, position: Sequence[float]) -> FloatArray:
        """Velocity of a point fixed to a body or to the world [m/s], shape (time, 3)."""
        index = self.mechanism.body_index[body]
        if index < 0:
            return np.zeros((len(self.time), 3))
        arm = self.R_WB[:, index] @ np.asarray(position, dtype=np.float64)
        return np.asarray(self.v_WB[:, index] + cross(self.w_WB[:, index], arm))

    def spin(self, body: str) -> FloatArray:
        """Angular velocity of a body or of the world [rad/s], shape (time, 3)."""
        index = self.mechanism.body_index[body]
        return np.zeros((len(self.time), 3)) if index < 0 else self.w_WB[:, index]

    @cached_property
    def points(self) -> FloatArray:
        """Tracked points, or without any the centres of mass [m], shape (time, points, 3)."""
        return read_only(np.stack([self.point(*point) for point in self.mechanism.followed], axis=1))

    def coordinates(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Coordinate and rate of joints with one coordinate, by name [rad or m, per s]; angles count whole turns."""
        by_joint = {joint.name: self.along(joint) for joint in self.mechanism.joints if joint.nq == 1}
        return {name: (q[:, 0], v[:, 0]) for name, (q, v) in by_joint.items()}

    def of_tree(self) -> tuple[FloatArray, FloatArray]:
        """Coordinates and velocities of all joints, shapes (time, nq) and (time, nv)."""
        q, v = zip(*map(self.along, self.mechanism.joints), strict=True)
        return np.concatenate(q, axis=1), np.concatenate(v, axis=1)

    def along(self, joint: Joint) -> tuple[FloatArray, FloatArray]:
        """Coordinates and velocities of a joint, shapes (time, nq) and (time, nv); angles count whole turns."""
        parent, child = (self.mechanism.body_index[name] for name in (joint.parent, joint.child))
        A, B = self.R_WB[:, parent] @ joint.parent_frame, self.R_WB[:, child] @ joint.child_frame
        turned, turning = A.swapaxes(1, 2) @ B, self.spin(joint.child) - self.spin(joint.parent)
        q: list[FloatArray] = []
        v: list[FloatArray] = []
        for of_child, number, turns, _ in AXES[joint.kind]:
            axis = (B if of_child else A)[..., number]
            v.append(np.sum((turning if turns else self._apart(joint)[1]) * axis, -1))
            if joint.kind in WITH_QUATERNION:
                continue
            if turns:
                sine, cosine = (turned[:, 2, 1], turned[:, 2, 2]) if of_child else (turned[:, 1, 0], turned[:, 0, 0])
                q.append(self._on_turns(joint, len(q), np.arctan2(sine, cosine), v[-1]))
            else:
                q.append(np.sum(self._apart(joint)[0] * axis, -1))
        if joint.kind in WITH_QUATERNION:
            q = [*np.einsum("ti,tij->jt", self._apart(joint)[0], A)] if joint.kind == JointKind.FREE else []
            q += [*to_quaternion(turned).T]
        count = len(self.time)
        return np.reshape(q, (joint.nq, count)).T, np.reshape(v, (joint.nv, count)).T

    def _on_turns(self, joint: Joint, number: int, angle: FloatArray, rate: FloatArray) -> FloatArray:
        """Angle of a joint with whole turns added [rad], shape (time,)."""
        if self.known_q is None:
            return on_turns(self.time, angle, rate, joint.q0[number], TURN)
        prescribed = self.known_q[:, self.mechanism.q_slices[self.mechanism.joints.index(joint)].start + number]
        return np.asarray(angle + TURN * np.round((prescribed - angle) / TURN))

    def _apart(self, joint: Joint) -> tuple[FloatArray, FloatArray]:
        """Vector from a joint's point on the parent to that on the child [m]; its rate seen from the parent [m/s]."""
        there = self.point(joint.child, joint.child_position)
        carried = cross(self.spin(joint.parent), there - self.point(joint.parent, ZERO))
        rate = self.velocity(joint.child, joint.child_position) - self.velocity(joint.parent, ZERO) - carried
        return there - self.point(joint.parent, joint.position), rate

    def energy(self) -> FloatArray:
        """Kinetic energy, and potential energy of gravity and of all springs [J], shape (time,)."""
        return np.asarray(self.energies().sum(-1))

    def energies(self) -> FloatArray:
        """Kinetic, gravitational and elastic energies [J], shape (time, parts); they may cancel in the sum."""
        terms: list[FloatArray] = []
        for body in self.mechanism.bodies:
            R, w = self.R_WB[:, self.mechanism.body_index[body.name]], self.spin(body.name)
            local = np.einsum("tji,tj->ti", R, w)
            v = self.velocity(body.name, body.com)
            terms += [0.5 * body.mass * np.sum(v**2, -1), 0.5 * np.sum(local @ np.array(body.inertia) * local, -1)]
            terms += list(-body.mass * np.array(self.mechanism.gravity)[:, None] * self.point(body.name, body.com).T)
        for spring in self.mechanism.springs:
            ends = self.point(spring.body_a, spring.position_a) - self.point(spring.body_b, spring.position_b)
            terms.append(0.5 * spring.stiffness * (np.linalg.norm(ends, axis=-1) - spring.length) ** 2)
        for bushing in self.mechanism.bushings:
            terms += self._of_bushing(bushing)
        for joint in self.mechanism.joints:
            if joint.stiffness or joint.armature:
                q, v = self.along(joint)
                terms.append(0.5 * np.sum(joint.stiffness * (q - joint.rest) ** 2 + joint.armature * v**2, -1))
        return np.array(terms).T

    def _of_bushing(self, bushing: Bushing) -> list[FloatArray]:
        from scipy.spatial.transform import Rotation

        A = self.R_WB[:, self.mechanism.body_index[bushing.body_a]] @ bushing.frame_a
        B = self.R_WB[:, self.mechanism.body_index[bushing.body_b]] @ bushing.frame_b
        apart = self.point(bushing.body_b, bushing.position_b) - self.point(bushing.body_a, bushing.position_a)
        turned = Rotation.from_matrix(A.swapaxes(1, 2) @ B).as_rotvec()
        sizes = np.concatenate([np.einsum("tji,tj->ti", A, apart), turned], axis=1)
        return list(0.5 * np.array(bushing.stiffness)[:, None] * sizes.T**2)

    def momentum(self) -> tuple[FloatArray, FloatArray]:
        """Momentum [N s] and moment of momentum about the world's origin [N m s], shapes (time, 3)."""
        linear, angular = np.zeros((len(self.time), 3)), np.zeros((len(self.time), 3))
        for body in self.mechanism.bodies:
            R, body_momentum = (
                self.R_WB[:, self.mechanism.body_index[body.name]],
                body.mass * self.velocity(body.name, body.com),
            )
            local = np.einsum("tji,tj->ti", R, self.spin(body.name)) @ np.array(body.inertia)
            linear += body_momentum
            angular += cross(self.point(body.name, body.com), body_momentum) + np.einsum("tij,tj->ti", R, local)
        return linear, angular

    def drift(self) -> FloatArray:
        """Largest violation of a joint, loop or prescribed motion: distance [m], cosine [1] or angle, shape (time,)."""
        worst = np.zeros(len(self.time))
        for _, kind, a, at_a, frame_a, b, at_b, frame_b, length in self.mechanism.connections:
            A = self.R_WB[:, self.mechanism.body_index[a]] @ frame_a
            B = self.R_WB[:, self.mechanism.body_index[b]] @ frame_b
            apart = self.point(b, at_b) - self.point(a, at_a)
            if kind == DISTANCE:
                worst = np.maximum(worst, np.abs(np.linalg.norm(apart, axis=-1) - length))
                continue
            for axis in FACTS[kind].translations:
                worst = np.maximum(worst, np.abs(np.sum(apart * A[..., axis], -1)))
            for axis_a, axis_b in FACTS[kind].rotations:
                worst = np.maximum(worst, np.abs(np.sum(A[..., axis_a] * B[..., axis_b], -1)))
        for joint, _, _ in self.mechanism.prescribed:
            assert joint.motion is not None  # as of all prescribed ones
            worst = np.maximum(worst, np.abs(self.along(joint)[0][:, 0] - moved(joint.motion, self.time).place))
        return worst
