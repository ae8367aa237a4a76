"""Forward kinematics of a mechanism's tree in joint coordinates, and the rows of its loops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism import joint_motion
from proofroll.elements.mechanism.joint import FACTS
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Loop
from proofroll.elements.mechanism.rotations import Array, cross

_O = np.zeros(3)


@dataclass(frozen=True)
class BodyMotion:
    """Motion of all bodies at one instant, world axes; the last entry of every array over bodies is the world.

    Attributes:
        p_WB, v_WB: position and velocity of the origin of each body's frame, m, m/s; (bodies + 1, 3).
        R_WB, w_WB: rotation and angular velocity, rad/s; (bodies + 1, 3, 3), (bodies + 1, 3).
        J: derivative of (v_WB, w_WB) by the velocities of the tree, (bodies + 1, 6, nv).
        bias: acceleration (linear, angular) of each body where v̇ = 0, (bodies + 1, 6).
        p_joint: position of each joint on its child, (joints, 3).
        R_parent, R_child: its frames A and B, (joints, 3, 3).
    """

    p_WB: Array
    R_WB: Array
    v_WB: Array
    w_WB: Array
    J: Array
    bias: Array
    p_joint: Array
    R_parent: Array
    R_child: Array


class Rows(NamedTuple):
    """Constraints of loops: Φ(q) = 0, C v = 0, C v̇ + bias = 0.

    Each row is n·(v_b − v_a) + t·(ω_b − ω_a) − (d×n)·ω_a at the loop's points, d from a to b.

    Attributes:
        residual: Φ, m or 1, (m).
        C, bias: (m, nv), (m).
        force, torque: n and t, what a unit multiplier applies to body_b at its point, (m, 3).
        loop: index of each row's loop, (m).
    """

    residual: Array
    C: Array
    bias: Array
    force: Array
    torque: Array
    loop: NDArray[np.intp]


class Tree:
    """The kinematics of one mechanism; what does not move is computed once.

    Args:
        mechanism: bodies and joints.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        index = mechanism.body_index
        self.parents = [index[joint.parent] for joint in mechanism.joints]
        self.children = [index[joint.child] for joint in mechanism.joints]
        self._static = [
            (joint, np.array(joint.position), joint.parent_frame, joint.child_frame.T, np.array(joint.child_position))
            for joint in mechanism.joints
        ]

    def rate(self, q: Array, v: Array) -> Array:
        """Time derivative of the coordinates (nq) for velocities (nv)."""
        rate = np.zeros(self.mechanism.nq)
        for joint, at_q, at_v in zip(
            self.mechanism.joints, self.mechanism.q_slices, self.mechanism.v_slices, strict=True
        ):
            rate[at_q] = joint_motion.rate(joint.kind, q[at_q], v[at_v])
        return rate

    def normalised(self, q: Array) -> Array:
        """The coordinates with quaternions of unit length."""
        q = q.copy()
        for joint, at_q in zip(self.mechanism.joints, self.mechanism.q_slices, strict=True):
            if joint.kind in {"spherical", "free"}:
                quaternion = q[at_q][-4:]
                q[at_q.stop - 4 : at_q.stop] = quaternion / np.linalg.norm(quaternion)
        return q

    def moved(self, q: Array, dv: Array) -> Array:
        """The coordinates after a small motion ``dv`` (nv), to first order, quaternions of unit length."""
        return self.normalised(q + self.rate(q, dv))

    def at(self, q: Array, v: Array) -> BodyMotion:
        """Motion of all bodies for coordinates q (nq) and velocities v (nv)."""
        n, nv, nj = len(self.mechanism.bodies), self.mechanism.nv, len(self._static)
        p, R, w, vel = np.zeros((n + 1, 3)), np.zeros((n + 1, 3, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 3))
        J, bias = np.zeros((n + 1, 6, nv)), np.zeros((n + 1, 6))
        p_joint, R_parent, R_child = np.zeros((nj, 3)), np.zeros((nj, 3, 3)), np.zeros((nj, 3, 3))
        R[n] = np.eye(3)
        slices = zip(self.mechanism.q_slices, self.mechanism.v_slices, strict=True)
        for k, ((joint, position, frame, back, child_position), (at_q, at_v)) in enumerate(
            zip(self._static, slices, strict=True)
        ):
            i, c = self.parents[k], self.children[k]
            A = R[i] @ frame
            d, S = joint_motion.placed(joint.kind, q[at_q])
            B = A @ S
            R[c] = B @ back
            r = R[i] @ position + A @ d
            arm = -(R[c] @ child_position)
            p_joint[k], R_parent[k], R_child[k] = p[i] + r, A, B
            p[c] = p_joint[k] + arm
            linear, angular, linear_bias, angular_bias = joint_motion.subspace(joint.kind, A, B, v[at_v], w[i])
            # the joint's point of the child, then the origin of the child's frame
            J[c] = J[i]
            J[c, :3] -= _crosses(r, J[i, 3:])
            J[c, 3:, at_v] += angular
            J[c, :3, at_v] += linear
            J[c, :3] -= _crosses(arm, J[c, 3:])
            w[c] = w[i] + angular @ v[at_v]
            slide = linear @ v[at_v]
            r_rate = cross(w[i], r) + slide
            vel[c] = vel[i] + r_rate + cross(w[c], arm)
            alpha = bias[i, 3:] + angular_bias
            bias[c, 3:] = alpha
            bias[c, :3] = (
                bias[i, :3]
                + cross(bias[i, 3:], r)
                + cross(w[i], r_rate)
                + linear_bias
                + cross(alpha, arm)
                + cross(w[c], cross(w[c], arm))
            )
        return BodyMotion(p, R, vel, w, J, bias, p_joint, R_parent, R_child)

    def point(self, motion: BodyMotion, body: str, position: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, derivative of it by v (3, nv) and bias acceleration of a point of a body."""
        i = self.mechanism.body_index[body]
        arm, w = motion.R_WB[i] @ position, motion.w_WB[i]
        return (
            motion.p_WB[i] + arm,
            motion.v_WB[i] + cross(w, arm),
            motion.J[i, :3] - _crosses(arm, motion.J[i, 3:]),
            motion.bias[i, :3] + cross(motion.bias[i, 3:], arm) + cross(w, cross(w, arm)),
        )

    def loop_rows(self, motion: BodyMotion) -> Rows:
        """Residuals and rows of all loops."""
        parts = [self._rows_of(motion, loop) for loop in self.mechanism.loops]
        if not parts:
            none, nv = np.zeros(0), self.mechanism.nv
            return Rows(none, np.zeros((0, nv)), none, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=int))
        loop = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
        residual, C, bias, force, torque = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        return Rows(residual, C, bias, force, torque, loop)

    def _rows_of(self, motion: BodyMotion, loop: Loop) -> tuple[Array, Array, Array, Array, Array]:
        a, b = self.mechanism.body_index[loop.body_a], self.mechanism.body_index[loop.body_b]
        p_a, v_a, J_a, bias_a = self.point(motion, loop.body_a, np.array(loop.position_a))
        p_b, v_b, J_b, bias_b = self.point(motion, loop.body_b, np.array(loop.position_b))
        A, B = motion.R_WB[a] @ loop.frame_a, motion.R_WB[b] @ loop.frame_b
        w_a, w_b = motion.w_WB[a], motion.w_WB[b]
        turn, turn_bias = motion.J[b, 3:] - motion.J[a, 3:], motion.bias[b, 3:] - motion.bias[a, 3:]
        d, d_rate = p_b - p_a, v_b - v_a
        facts = FACTS[loop.kind]
        residual, C, bias, force, torque = [], [], [], [], []
        for k in facts.translations:
            # three locked directions hold two points together in the world; fewer hold along axes that move with a
            fixed = len(facts.translations) == 3
            n = np.eye(3)[k] if fixed else A[:, k]
            residual.append(n @ d)
            row, acceleration = n @ (J_b - J_a), n @ (bias_b - bias_a)
            if not fixed:
                n_rate = cross(w_a, n)
                row = row - cross(d, n) @ motion.J[a, 3:]
                acceleration += 2 * n_rate @ d_rate + (cross(motion.bias[a, 3:], n) + cross(w_a, n_rate)) @ d
            C.append(row)
            bias.append(acceleration)
            force.append(n)
            torque.append(_O)
        for k, m in facts.rotations:
            x, y = A[:, k], B[:, m]
            t = cross(y, x)
            x_rate, y_rate = cross(w_a, x), cross(w_b, y)
            residual.append(x @ y)
            C.append(t @ turn)
            bias.append(t @ turn_bias + cross(w_a, x_rate) @ y + 2 * x_rate @ y_rate + x @ cross(w_b, y_rate))
            force.append(_O)
            torque.append(t)
        return np.array(residual), np.array(C), np.array(bias), np.array(force), np.array(torque)


def _crosses(a: Array, columns: Array) -> Array:
    """A × each column."""
    a0, a1, a2 = a.tolist()
    x, y, z = columns
    return np.array([a1 * z - a2 * y, a2 * x - a0 * z, a0 * y - a1 * x])
