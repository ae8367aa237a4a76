"""Bodies cut apart and held by the rows of revolute joints, projected with a fixed rank, in numpy and LAPACK alone.

The formulas of Blajer (2006, section 2; 2002, for the elimination), as a careful reader would code them for revolute
joints: M^(-1/2) is constant, and the singular vectors of the rows times it span the constrained subspace.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg.lapack import dgesdd

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism import Tree
from proofroll.elements.mechanism.rotations import to_quaternion
from proofroll.elements.mechanism.sampling import independent


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    a0, a1, a2 = a.T
    b0, b1, b2 = b.T
    return np.array((a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0)).T


def _by(R: FloatArray, a: FloatArray) -> FloatArray:
    return np.asarray(np.matmul(R, a[:, :, None])[:, :, 0])


class CutApart:
    """Equations in (r, quaternions, v, ω along the bodies' axes), of all bodies one after the other."""

    def __init__(self, mechanism: Any) -> None:
        bodies, index, n = mechanism.bodies, mechanism.body_index, len(mechanism.bodies)
        self.n, self.gravity = n, np.array(mechanism.gravity)
        self.com = np.array([body.com for body in bodies])
        self.inertia = np.array([body.inertia for body in bodies])
        self.root = np.zeros((6 * n, 6 * n))
        for i, body in enumerate(bodies):
            k = 6 * i
            self.root[k : k + 3, k : k + 3] = np.eye(3) / np.sqrt(body.mass)
            self.root[k + 3 : k + 6, k + 3 : k + 6] = np.linalg.inv(np.linalg.cholesky(self.inertia[i])).T
        self.weight = np.array([body.mass for body in bodies])[:, None] * self.gravity
        ends, com = mechanism.connections, np.vstack([self.com, np.zeros(3)])
        self.a = np.array([index[end.a] % (n + 1) for end in ends])
        self.b = np.array([index[end.b] % (n + 1) for end in ends])
        self.at_a = np.array([end.position_a for end in ends]) - com[self.a]
        self.at_b = np.array([end.position_b for end in ends]) - com[self.b]
        self.A = np.array([end.frame_a for end in ends])[:, :, :2]
        self.B = np.array([end.frame_b for end in ends])[:, :, 2]
        self.rank = 0
        motion = Tree(mechanism).at(*mechanism.start())
        R, w = motion.R_WB[:n], motion.w_WB[:n]
        arm = _by(R, self.com)
        r, v = motion.p_WB[:n] + arm, motion.v_WB[:n] + _cross(w, arm)
        q = np.array([to_quaternion(one) for one in R])
        self.start = np.concatenate([r.ravel(), q.ravel(), v.ravel(), _by(R.transpose(0, 2, 1), w).ravel()])
        self.rank = independent(self._rows(self.start)[1])

    def _parts(self, x: FloatArray) -> tuple[FloatArray, ...]:
        n = self.n
        cuts = ((0, 3), (3, 7), (7, 10), (10, 13))
        return tuple(x[low * n : high * n].reshape(n, -1) for low, high in cuts)

    def _rows(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Violations, rows and drifts: three of each connection's points, two of its axes."""
        n, a, b = self.n, self.a, self.b
        r, q, _, w = (np.vstack([part, np.zeros(part.shape[1])]) for part in self._parts(x))
        q[n, 0] = 1.0
        R = _rotations(q)
        w = _by(R, w)
        R_a, R_b, w_a, w_b = R[a], R[b], w[a], w[b]
        arm_a, arm_b = _by(R_a, self.at_a), _by(R_b, self.at_b)
        off = r[b] + arm_b - r[a] - arm_a
        bent = _cross(w_b, _cross(w_b, arm_b)) - _cross(w_a, _cross(w_a, arm_a))
        m = len(a)
        C = np.zeros((5, m, n + 1, 6))
        rows = np.arange(m)
        z = _by(R_b, self.B)
        z_rate = _cross(w_b, z)
        angles, turns = np.empty((2, m)), np.empty((2, m))
        for k in range(3):
            e = np.zeros((m, 3))
            e[:, k] = 1.0
            C[k, rows, b, k], C[k, rows, a, k] = 1.0, -1.0
            C[k, rows, b, 3:] = np.matmul(_cross(arm_b, e)[:, None], R_b)[:, 0]
            C[k, rows, a, 3:] = -np.matmul(_cross(arm_a, e)[:, None], R_a)[:, 0]
        for k in range(2):
            axis = _by(R_a, self.A[:, :, k])
            axis_rate, t = _cross(w_a, axis), _cross(z, axis)
            C[3 + k, rows, b, 3:] = np.matmul(t[:, None], R_b)[:, 0]
            C[3 + k, rows, a, 3:] = -np.matmul(t[:, None], R_a)[:, 0]
            angles[k] = (axis * z).sum(1)
            turns[k] = (_cross(w_a, axis_rate) * z + 2 * axis_rate * z_rate + axis * _cross(w_b, z_rate)).sum(1)
        return (
            np.concatenate([off.T.ravel(), angles.ravel()]),
            C[:, :, :n].reshape(5 * m, 6 * n),
            np.concatenate([bent.T.ravel(), turns.ravel()]),
        )

    def _split(self, C: FloatArray) -> tuple[FloatArray, FloatArray]:
        U, S, Vt, _ = dgesdd(C @ self.root, full_matrices=0)
        return Vt[: self.rank], U[:, : self.rank].T / S[: self.rank, None]

    def rates(self, x: FloatArray) -> FloatArray:
        """ẋ."""
        _, q, v, w = self._parts(x)
        _, C, drift = self._rows(x)
        force = np.hstack([self.weight, -_cross(w, _by(self.inertia, w))])
        free = self.root.T @ force.ravel()
        locked, back = self._split(C)
        u_rate = (self.root @ (free - locked.T @ (back @ drift + locked @ free))).reshape(self.n, 6)
        return np.concatenate([v.ravel(), _turning(q, w).ravel(), u_rate[:, :3].ravel(), u_rate[:, 3:].ravel()])

    def normalised(self, x: FloatArray) -> FloatArray:
        """State with quaternions of unit length."""
        x = x.copy()
        q = self._parts(x)[1]
        q[:] = q / np.sqrt((q * q).sum(1))[:, None]
        return x

    def eliminated(self, x: FloatArray) -> FloatArray:
        """Without violations of places and velocities."""
        x = self.normalised(x)
        off, C, _ = self._rows(x)
        locked, back = self._split(C)
        into = self.root @ locked.T
        r, q, v, w = self._parts(x)
        u = np.hstack([v, w]).ravel()
        moved = (u - into @ (back @ (C @ u))).reshape(self.n, 6)
        step = (-into @ (back @ off)).reshape(self.n, 6)
        v[:], w[:] = moved[:, :3], moved[:, 3:]
        q += _turning(q, step[:, 3:])
        r += step[:, :3]
        return self.normalised(x)

    def origins(self, x: FloatArray) -> FloatArray:
        """Origins of the bodies' frames [m], shape (bodies, 3)."""
        r, q, _, _ = self._parts(x)
        return np.asarray(r - _by(_rotations(q), self.com))


def _rotations(q: FloatArray) -> FloatArray:
    w, x, y, z = q.T * np.sqrt(2 / (q * q).sum(1))
    return np.array(
        (
            (1 - y * y - z * z, x * y - w * z, x * z + w * y),
            (x * y + w * z, 1 - x * x - z * z, y * z - w * x),
            (x * z - w * y, y * z + w * x, 1 - x * x - y * y),
        )
    ).transpose(2, 0, 1)


def _turning(q: FloatArray, w: FloatArray) -> FloatArray:
    (a, b, c, d), (x, y, z) = q.T, 0.5 * w.T
    return np.array((-b * x - c * y - d * z, a * x + c * z - d * y, a * y + d * x - b * z, a * z + b * y - c * x)).T
