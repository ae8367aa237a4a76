"""Rows of the holonomic constraints on dependent coordinates: every joint and loop cuts the bodies apart.

The dependent velocities of a body are v of its centre of mass along the world's axes and ω along its own, so that the
mass matrix is constant and a fast spin costs no digits. A connection of body a (point a, axes A) with body b (point b,
axes B), d from point a to b, gives rows of two kinds:

* n·d = 0, two points do not separate along n: each direction of the world where all three are locked, else axes of A;
* x·y = 0, an axis x of A and an axis y of B stay perpendicular.

Both have the form n·(v_b − v_a) + m_b·ω_b − m_a·ω_a, so that all rows are found at once from n, m_a and m_b.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.joint import FACTS
from proofroll.elements.mechanism.rotations import Array


class Bodies(NamedTuple):
    """Motion of the bodies' centres of mass, the world last: r, R, v, ω along the world's axes; (bodies + 1, …)."""

    r: Array
    R: Array
    v: Array
    w: Array


class Ends(NamedTuple):
    """Connections now, world axes: arms from the centres of mass, d and its rate, axes A and B, (connections, …)."""

    arm_a: Array
    arm_b: Array
    d: Array
    d_rate: Array
    A: Array
    B: Array


class ConnectionRows(NamedTuple):
    """Φ (rows,), C of the dependent velocities (rows, 6 bodies), Ċ times them (rows,), n and x × y (rows, 3)."""

    residual: Array
    C: Array
    drift: Array
    force: Array
    torque: Array


def turned(R: Array, a: Array) -> Array:
    """Each vector by its own matrix."""
    found: Array = np.matmul(R, a[:, :, None])[:, :, 0]
    return found


def _dot(a: Array, b: Array) -> Array:
    """Products of two lists of vectors."""
    return np.asarray((a * b).sum(1))


class ProjectedConnections:
    """All joints, then all loops, of a mechanism.

    Attributes:
        a, b: index of the bodies of each connection; the world is the last body.
        owner: the connection of each row.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        count, index = len(mechanism.bodies), mechanism.body_index
        self._count = count
        com = np.array([*(body.com for body in mechanism.bodies), (0.0, 0.0, 0.0)])
        cut = [
            (j.kind, j.parent, j.child, j.position, j.child_position, j.parent_frame, j.child_frame)
            for j in mechanism.joints
        ] + [
            (loop.kind, loop.body_a, loop.body_b, loop.position_a, loop.position_b, loop.frame_a, loop.frame_b)
            for loop in mechanism.loops
        ]
        self.a = np.array([index[item[1]] % (count + 1) for item in cut], dtype=np.intp)
        self.b = np.array([index[item[2]] % (count + 1) for item in cut], dtype=np.intp)
        self._at_a = np.array([item[3] for item in cut]) - com[self.a]
        self._at_b = np.array([item[4] for item in cut]) - com[self.b]
        self._A = np.array([item[5] for item in cut])
        self._B = np.array([item[6] for item in cut])
        points = [(number, k) for number, item in enumerate(cut) for k in FACTS[item[0]].translations]
        angles = [(number, *pair) for number, item in enumerate(cut) for pair in FACTS[item[0]].rotations]
        self._point, self._axis = np.array(points, dtype=np.intp).reshape(-1, 2).T
        self._angle, self._x, self._y = np.array(angles, dtype=np.intp).reshape(-1, 3).T
        locked = np.array([len(FACTS[item[0]].translations) for item in cut], dtype=np.intp)
        # whether a row's direction moves with body a
        self._moving = (locked[self._point] < 3).astype(float)[:, None]
        self.owner = np.concatenate([self._point, self._angle])

    def ends(self, bodies: Bodies) -> Ends:
        """Where the connections' ends are."""
        (r, R, v, w), a, b = bodies, self.a, self.b
        R_a, R_b = R[a], R[b]
        arm_a, arm_b = turned(R_a, self._at_a), turned(R_b, self._at_b)
        d = r[b] + arm_b - r[a] - arm_a
        d_rate = v[b] + cross(w[b], arm_b) - v[a] - cross(w[a], arm_a)
        return Ends(arm_a, arm_b, d, d_rate, R_a @ self._A, R_b @ self._B)

    def rows(self, bodies: Bodies, ends: Ends) -> ConnectionRows:
        """The rows of all connections: those of points, then those of angles."""
        w_a, w_b = bodies.w[self.a], bodies.w[self.b]
        bent = cross(w_b, cross(w_b, ends.arm_b)) - cross(w_a, cross(w_a, ends.arm_a))
        i, moving = self._point, self._moving
        d = ends.d[i]
        n = np.where(moving > 0, ends.A[i, :, self._axis], np.eye(3)[self._axis])
        n_rate = moving * cross(w_a[i], n)
        bending = _dot(n, bent[i]) + 2 * _dot(n_rate, ends.d_rate[i]) + _dot(moving * cross(w_a[i], n_rate), d)
        j = self._angle
        x, y = ends.A[j, :, self._x], ends.B[j, :, self._y]
        x_rate, y_rate, t = cross(w_a[j], x), cross(w_b[j], y), cross(y, x)
        turning = _dot(cross(w_a[j], x_rate), y) + 2 * _dot(x_rate, y_rate) + _dot(x, cross(w_b[j], y_rate))
        m_a = np.concatenate([cross(ends.arm_a[i] + moving * d, n), t])
        m_b = np.concatenate([cross(ends.arm_b[i], n), t])
        force, torque = np.concatenate([n, np.zeros_like(t)]), np.concatenate([np.zeros_like(n), t])
        residual, drift = np.concatenate([_dot(n, d), _dot(x, y)]), np.concatenate([bending, turning])
        return ConnectionRows(residual, self.spread(bodies, self.owner, force, m_a, m_b), drift, force, torque)

    def spread(self, bodies: Bodies, connection: NDArray[np.intp], n: Array, m_a: Array, m_b: Array) -> Array:
        """n·(v_b − v_a) + m_b·ω_b − m_a·ω_a on the dependent velocities of all bodies, shape (rows, 6 bodies)."""
        rows, a, b = np.arange(len(n)), self.a[connection], self.b[connection]
        C = np.zeros((len(n), self._count + 1, 6))
        C[rows, b, :3], C[rows, b, 3:] = n, np.matmul(m_b[:, None, :], bodies.R[b])[:, 0]
        C[rows, a, :3], C[rows, a, 3:] = -n, -np.matmul(m_a[:, None, :], bodies.R[a])[:, 0]
        return C[:, : self._count].reshape(len(n), 6 * self._count)
