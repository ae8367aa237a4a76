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
    """Connections now, world axes: arms from the centres of mass, d and its rate, axes A and B, (connections, …).

    ``turning_a`` and ``turning_b`` have axes and arm of an end as columns, then ω × them, then ω × (ω × them),
    (3, connections, 3, 4).
    """

    arm_a: Array
    arm_b: Array
    d: Array
    d_rate: Array
    A: Array
    B: Array
    turning_a: Array
    turning_b: Array


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


# Matrix of ω × from ω, its nine elements in a row.
_SKEW = np.array([[0.0, 0, 0, 0, 0, -1, 0, 1, 0], [0.0, 0, 1, 0, 0, 0, -1, 0, 0], [0.0, -1, 0, 1, 0, 0, 0, 0, 0]])


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
        cut = mechanism.connections
        self.a = np.array([index[item.a] % (count + 1) for item in cut], dtype=np.intp)
        self.b = np.array([index[item.b] % (count + 1) for item in cut], dtype=np.intp)
        at_a = np.array([item.position_a for item in cut]) - com[self.a]
        at_b = np.array([item.position_b for item in cut]) - com[self.b]
        self._at_a = np.concatenate([np.array([item.frame_a for item in cut]), at_a[:, :, None]], axis=2)
        self._at_b = np.concatenate([np.array([item.frame_b for item in cut]), at_b[:, :, None]], axis=2)
        points = [(number, k) for number, item in enumerate(cut) for k in FACTS[item.kind].translations]
        angles = [(number, *pair) for number, item in enumerate(cut) for pair in FACTS[item.kind].rotations]
        self._point, self._axis = np.array(points, dtype=np.intp).reshape(-1, 2).T
        self._angle, self._x, self._y = np.array(angles, dtype=np.intp).reshape(-1, 3).T
        locked = np.array([len(FACTS[item.kind].translations) for item in cut], dtype=np.intp)
        # whether a row's direction moves with body a
        self._moves = (locked[self._point] < 3)[:, None]
        self._moving, self._fixed = self._moves.astype(float), np.eye(3)[self._axis]
        self.owner = np.concatenate([self._point, self._angle])

    def ends(self, bodies: Bodies) -> Ends:
        """Positions and orientations of the connections' ends."""
        (r, R, v, w), a, b = bodies, self.a, self.b
        turning = np.empty((3, *R.shape))
        spin = (w @ _SKEW).reshape(R.shape)
        turning[0] = R
        np.matmul(spin, R, out=turning[1])
        np.matmul(spin, turning[1], out=turning[2])
        of_a, of_b = turning[:, a] @ self._at_a, turning[:, b] @ self._at_b
        arm_a, arm_b = of_a[0, :, :, 3], of_b[0, :, :, 3]
        d = r[b] + arm_b - r[a] - arm_a
        d_rate = v[b] + of_b[1, :, :, 3] - v[a] - of_a[1, :, :, 3]
        return Ends(arm_a, arm_b, d, d_rate, of_a[0, :, :, :3], of_b[0, :, :, :3], of_a, of_b)

    def rows(self, bodies: Bodies, ends: Ends) -> ConnectionRows:
        """The rows of all connections: those of points, then those of angles."""
        i, moving = self._point, self._moving
        d, bent = ends.d[i], ends.turning_b[2, i, :, 3] - ends.turning_a[2, i, :, 3]
        along, along_rate, along_bent = ends.turning_a[:, i, :, self._axis].swapaxes(0, 1)
        n = np.where(self._moves, along, self._fixed)
        bending = n * bent + moving * (2 * along_rate * ends.d_rate[i] + along_bent * d)
        j = self._angle
        x, x_rate, x_bent = ends.turning_a[:, j, :, self._x].swapaxes(0, 1)
        y, y_rate, y_bent = ends.turning_b[:, j, :, self._y].swapaxes(0, 1)
        turning = x_bent * y + 2 * x_rate * y_rate + x * y_bent
        arms = np.concatenate([y, ends.arm_b[i], ends.arm_a[i] + moving * d])
        moments = cross(arms, np.concatenate([x, n, n]))
        t, m_b, m_a = np.split(moments, [len(x), len(x) + len(n)])
        none = np.zeros_like(t)
        force, torque = np.concatenate([n, none]), np.concatenate([np.zeros_like(n), t])
        residual = np.concatenate([n * d, x * y]).sum(1)
        drift = np.concatenate([bending, turning]).sum(1)
        C = self.spread(bodies, self.owner, force, np.concatenate([m_a, t]), np.concatenate([m_b, t]))
        return ConnectionRows(residual, C, drift, force, torque)

    def spread(self, bodies: Bodies, connection: NDArray[np.intp], n: Array, m_a: Array, m_b: Array) -> Array:
        """n·(v_b − v_a) + m_b·ω_b − m_a·ω_a on the dependent velocities of all bodies, shape (rows, 6 bodies)."""
        rows, a, b = np.arange(len(n)), self.a[connection], self.b[connection]
        C = np.zeros((len(n), self._count + 1, 6))
        C[rows, b] = np.concatenate([n, np.matmul(m_b[:, None, :], bodies.R[b])[:, 0]], axis=1)
        C[rows, a] = -np.concatenate([n, np.matmul(m_a[:, None, :], bodies.R[a])[:, 0]], axis=1)
        return C[:, : self._count].reshape(len(n), 6 * self._count)
