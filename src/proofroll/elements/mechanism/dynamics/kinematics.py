"""Forward kinematics of a mechanism's tree in joint coordinates, and the constraint rows of its loops."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism.scene.drives import Coupling
from proofroll.elements.mechanism.scene.joint import Joint, child_in_parent, coordinate_rate
from proofroll.elements.mechanism.scene.joint_kinds import AXES, DISTANCE, FACTS, WITH_QUATERNION
from proofroll.elements.mechanism.scene.kinks import Functions
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Loop
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array, cross
from proofroll.elements.mechanism.scene.signal import FUNCTIONS

_O, _UNIT = np.zeros(3), np.eye(3)


@dataclass(frozen=True)
class BodyMotion:
    """Motion of all bodies at one instant, world axes; the last entry of every array over bodies is the world.

    Attributes:
        p_WB, v_WB: position and velocity of the origin of each body's frame, m, m/s; (bodies + 1, 3).
        R_WB, w_WB: rotation and angular velocity, rad/s; (bodies + 1, 3, 3), (bodies + 1, 3).
        J: derivative of (v_WB, w_WB) by the velocities of the tree, (bodies + 1, 6, nv).
        bias: acceleration (linear, angular) of each body where v̇ = 0, (bodies + 1, 6).
        p_joint: position of each joint on its child, (joints, 3).
        R_parent: its frame A, (joints, 3, 3).
        q: coordinates of the tree, (nq).
    """

    p_WB: Array
    R_WB: Array
    v_WB: Array
    w_WB: Array
    J: Array
    bias: Array
    p_joint: Array
    R_parent: Array
    q: Array


class Rows(NamedTuple):
    """Constraints of loops, then of couplings, then of prescribed motions: Φ(q) = 0, C v = rate, C v̇ + bias = 0.

    Each row of a loop is n·(v_b − v_a) + t·(ω_b − ω_a) − (d×n)·ω_a at its points, d from a to b. That of a coupling
    has no n and no t, nor has that of a motion, whose Φ is zero and whose rate is the joint's present one: it holds
    the acceleration, so that integration alone makes place and rate.

    Attributes:
        residual: Φ, m or 1, (m).
        C, bias: (m, nv), (m).
        force, torque: n and t, what a unit multiplier applies to body_b at its point, (m, 3).
        loop: index of each row's loop, those of couplings and motions after those of loops, (m).
        moved: number of rows of motions.
    """

    residual: Array
    C: Array
    bias: Array
    force: Array
    torque: Array
    loop: NDArray[np.intp]
    moved: int

    def opening(self, v: Array) -> Array:
        """Rates C v of the violations for velocities v, (m); of motions zero."""
        rates = self.C @ v
        rates[len(rates) - self.moved :] = 0.0
        return np.asarray(rates)


class Tree:
    """The kinematics of one mechanism; what does not move is computed once."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        index, joints, nv = mechanism.body_index, mechanism.joints, mechanism.nv
        self.parents = [index[joint.parent] for joint in joints]
        self.children = [index[joint.child] for joint in joints]
        self._static = [
            (
                joint.kind,
                columns,
                np.array(joint.position),
                joint.parent_frame,
                joint.child_frame.T,
                np.array(joint.child_position),
            )
            for joint, columns in zip(joints, mechanism.q_slices, strict=True)
        ]
        axes = [(k, *axis) for k, joint in enumerate(joints) for axis in AXES[joint.kind]]
        self._joint, self._in_child, self._axis, turns, by_child = np.array(axes, dtype=int).reshape(nv, 5).T
        self._turns = turns.astype(float)
        self._carrier = np.array([self.parents, self.children])[by_child, self._joint]
        self._moves = np.zeros((len(mechanism.bodies) + 1, nv))  # 1 where a velocity moves a body
        for parent, child, columns in zip(self.parents, self.children, mechanism.v_slices, strict=True):
            self._moves[child] = self._moves[parent]
            self._moves[child, columns] = 1.0

    def rate(self, q: Array, v: Array) -> Array:
        """Time derivative of the coordinates (nq) for velocities (nv)."""
        rate = np.zeros(self.mechanism.nq)
        for joint, at_q, at_v in zip(
            self.mechanism.joints, self.mechanism.q_slices, self.mechanism.v_slices, strict=True
        ):
            rate[at_q] = coordinate_rate(joint.kind, q[at_q], v[at_v])
        return rate

    def normalised(self, q: Array) -> Array:
        """The coordinates with quaternions of unit length."""
        q = q.copy()
        for joint, at_q in zip(self.mechanism.joints, self.mechanism.q_slices, strict=True):
            if joint.kind in WITH_QUATERNION:
                quaternion = q[at_q][-4:]
                q[at_q.stop - 4 : at_q.stop] = quaternion / np.linalg.norm(quaternion)
        return q

    def moved(self, q: Array, dv: Array) -> Array:
        """The coordinates after a small motion ``dv`` (nv), to first order, quaternions of unit length."""
        return self.normalised(q + self.rate(q, dv))

    def at(self, q: Array, v: Array) -> BodyMotion:
        """Motion of all bodies for coordinates q (nq) and velocities v (nv)."""
        n, nj = len(self.mechanism.bodies), len(self._static)
        shapes = (n + 1, 3), (n + 1, 3, 3), (nj, 3), (2, nj, 3, 3)
        p, R, p_joint, frames = (np.zeros(shape, np.result_type(q, float)) for shape in shapes)  # floats or symbols
        R[n] = _UNIT
        for k, (kind, columns, position, frame, back, child_position) in enumerate(self._static):
            i, c = self.parents[k], self.children[k]
            A = R[i] @ frame
            d, S = child_in_parent(kind, q[columns])
            B = A @ S
            R[c] = B @ back
            p_joint[k] = p[i] + R[i] @ position + A @ d
            p[c] = p_joint[k] - R[c] @ child_position
            frames[0, k], frames[1, k] = A, B
        axes = frames[self._in_child, self._joint, :, self._axis].T
        arms = p.T[:, :, None] - p_joint.T[:, None, self._joint]
        turning = axes * self._turns
        J = self._twists(axes - turning, turning, _cross(turning, arms))
        twists = J @ v
        vel, w = twists[:, :3], twists[:, 3:]
        v_joint = vel.T[:, self.children] + _cross(w.T[:, self.children], (p_joint - p[self.children]).T)
        rates = _cross(w[self._carrier].T, axes)
        turning_rate = rates * self._turns
        arm_rates = vel.T[:, :, None] - v_joint[:, None, self._joint]
        turned_rate = _cross(turning_rate, arms) + _cross(turning, arm_rates)
        J_rate = self._twists(rates - turning_rate, turning_rate, turned_rate)
        return BodyMotion(
            p_WB=p, R_WB=R, v_WB=vel, w_WB=w, J=J, bias=J_rate @ v, p_joint=p_joint, R_parent=frames[0], q=q
        )

    def _twists(self, sliding: Array, turning: Array, turned: Array) -> Array:
        """Jacobian of each body, (bodies + 1, 6, nv), from columns that slide and turn it and ω × arm."""
        J = np.empty((len(self._moves), 6, len(self._joint)), turning.dtype)
        J[:, :3] = (sliding[:, None] + turned).transpose(1, 0, 2)
        J[:, 3:] = turning
        J *= self._moves[:, None]
        return J

    def point(self, motion: BodyMotion, body: str, position: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, derivative of it by v (3, nv) and bias acceleration of a point of a body."""
        i = self.mechanism.body_index[body]
        arm, w = motion.R_WB[i] @ position, motion.w_WB[i]
        return (
            motion.p_WB[i] + arm,
            motion.v_WB[i] + cross(w, arm),
            motion.J[i, :3] + _cross(motion.J[i, 3:], arm),
            motion.bias[i, :3] + cross(motion.bias[i, 3:], arm) + cross(w, cross(w, arm)),
        )

    def loop_rows(self, motion: BodyMotion, time: float = 0.0, functions: Functions = FUNCTIONS) -> Rows:
        """Residuals and rows of all loops, then of all couplings, then of all prescribed motions at a time [s].

        ``functions``: of their formulas.
        """
        parts = [self._rows_of(motion, loop) for loop in self.mechanism.loops]
        parts += [self._coupled(motion, coupling) for coupling in self.mechanism.couplings]
        parts += [self._moved(joint, at_v, time, functions) for joint, _, at_v in self.mechanism.prescribed]
        if not parts:
            none, nv = np.zeros(0), self.mechanism.nv
            return Rows(
                residual=none,
                C=np.zeros((0, nv)),
                bias=none,
                force=np.zeros((0, 3)),
                torque=np.zeros((0, 3)),
                loop=np.zeros(0, dtype=int),
                moved=0,
            )
        loop = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
        residual, C, bias, force, torque = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        return Rows(
            residual=residual,
            C=C,
            bias=bias,
            force=force,
            torque=torque,
            loop=loop,
            moved=len(self.mechanism.prescribed),
        )

    def _coupled(self, motion: BodyMotion, coupling: Coupling) -> tuple[Array, Array, Array, Array, Array]:
        C, apart = np.zeros((1, self.mechanism.nv)), -coupling.place
        for name, factor in coupling.terms:
            at_q, at_v = self.mechanism.place_of(name)
            C[0, at_v] = factor
            apart += factor * motion.q[at_q]
        return np.array([apart]), C, np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3))

    def _moved(
        self, joint: Joint, at_v: int, time: float, functions: Functions
    ) -> tuple[Array, Array, Array, Array, Array]:
        assert joint.motion is not None  # as of all prescribed ones
        acceleration = float(moved(joint.motion, time, functions).acceleration)
        return (
            np.zeros(1),
            np.eye(self.mechanism.nv)[[at_v]],
            -np.array([acceleration]),
            np.zeros((1, 3)),
            np.zeros((1, 3)),
        )

    def _rows_of(self, motion: BodyMotion, loop: Loop) -> tuple[Array, Array, Array, Array, Array]:
        a, b = self.mechanism.body_index[loop.body_a], self.mechanism.body_index[loop.body_b]
        R_a, R_b, w_a, w_b = motion.R_WB[a], motion.R_WB[b], motion.w_WB[a], motion.w_WB[b]
        arm_a, arm_b = R_a @ loop.position_a, R_b @ loop.position_b
        slide_a, slide_b = cross(w_a, arm_a), cross(w_b, arm_b)
        d = motion.p_WB[b] + arm_b - motion.p_WB[a] - arm_a
        d_rate = motion.v_WB[b] + slide_b - motion.v_WB[a] - slide_a
        pull = cross(w_b, slide_b) - cross(w_a, slide_a)
        if loop.kind == DISTANCE:
            length = float(np.sqrt(d @ d))
            n = d / length
            stretching = n @ d_rate
            on_b, on_a = np.hstack([n, cross(arm_b, n)]), np.hstack([n, cross(arm_a, n)])
            C = on_b @ motion.J[b] - on_a @ motion.J[a]
            drift = on_b @ motion.bias[b] - on_a @ motion.bias[a]
            bend = n @ pull + (d_rate @ d_rate - stretching**2) / length
            return np.array([length - loop.length]), C[None], np.array([drift + bend]), n[None], np.zeros((1, 3))
        A, B = R_a @ loop.frame_a, R_b @ loop.frame_b
        facts = FACTS[loop.kind]
        # three locked directions hold two points together in the world; fewer hold along axes that move with a
        moving = len(facts.translations) < 3
        residual, bias, force, torque, moment_a, moment_b = [], [], [], [], [], []
        for k in facts.translations:
            n = A[:, k] if moving else _UNIT[k]
            acceleration = n @ pull
            if moving:
                n_rate = cross(w_a, n)
                acceleration += 2 * n_rate @ d_rate + cross(w_a, n_rate) @ d
            residual.append(n @ d)
            bias.append(acceleration)
            force.append(n)
            torque.append(_O)
            moment_a.append(cross(arm_a + d if moving else arm_a, n))
            moment_b.append(cross(arm_b, n))
        for k, m in facts.rotations:
            x, y = A[:, k], B[:, m]
            t = cross(y, x)
            x_rate, y_rate = cross(w_a, x), cross(w_b, y)
            residual.append(x @ y)
            bias.append(cross(w_a, x_rate) @ y + 2 * x_rate @ y_rate + x @ cross(w_b, y_rate))
            force.append(_O)
            torque.append(t)
            moment_a.append(t)
            moment_b.append(t)
        # a unit multiplier's force and moment about the origin of each body's frame
        on_a, on_b = np.hstack([force, moment_a]), np.hstack([force, moment_b])
        C = on_b @ motion.J[b] - on_a @ motion.J[a]
        drift = on_b @ motion.bias[b] - on_a @ motion.bias[a]
        return np.array(residual), C, drift + bias, np.array(force), np.array(torque)


def _cross(a: Array, b: Array) -> Array:
    """Cross products of vectors whose components are the first axis."""
    a0, a1, a2 = a
    b0, b1, b2 = b
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])
