"""Blajer's projection method for a mechanism in dependent coordinates: those of its bodies, cut apart.

With M u̇ = h + Cᵀλ and C u̇ = −γ, the velocities u of the bodies are split by the constraints into two subspaces that
are orthogonal in the metric of M: the constrained one, spanned by M⁻¹Cᵀ, in which the constraints alone decide, and the
one tangent to them, spanned by D with C D = 0, in which the applied forces alone decide. Projection on the first gives
the reactions, on the second the motion. The singular vectors of C M^(-1/2) span both, whether rows are redundant or
not; the number of independent ones is found at the start and kept.

Sources: W. Blajer, Math. Comput. Model. Dyn. Syst. 12(6), 2006, 543-553, for the projections; W. Blajer, Multibody
Syst. Dyn. 7, 2002, 265-284, for the elimination of constraint violations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import Mechanism, Tree
from proofroll.elements.mechanism.rotations import Array, to_quaternion
from proofroll.elements.mechanism.sampling import independent_anywhere
from proofroll.engines.projection.applied import Applied
from proofroll.engines.projection.connections import Bodies, ConnectionRows, Ends, ProjectedConnections


class SolvedState(NamedTuple):
    """Accelerations u̇ and multipliers, with what they were found from."""

    acceleration: Array
    multipliers: Array
    bodies: Bodies
    ends: Ends
    rows: ConnectionRows


class DependentCoordinates:
    """Equations of motion in the state (r, quaternions, v, ω): of all bodies one after the other.

    Attributes:
        mass, inertia: of the bodies, about their centres of mass and along their axes.
        com: in their frames.
        rank: number of independent rows.
        start: the state at time 0.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mass = np.array([body.mass for body in mechanism.bodies])
        self.inertia = np.array([body.inertia for body in mechanism.bodies])
        self.com = np.array([body.com for body in mechanism.bodies])
        self._count = n = len(self.mass)
        self.connections = ProjectedConnections(mechanism)
        self.applied = Applied(mechanism, self.connections)
        # M^(-1/2), block by block: it is constant, since ω is along the bodies' own axes
        self._root = np.zeros((6 * n, 6 * n))
        for i in range(n):
            at = slice(6 * i, 6 * i + 3), slice(6 * i + 3, 6 * i + 6)
            self._root[at[0], at[0]] = np.eye(3) / np.sqrt(self.mass[i])
            self._root[at[1], at[1]] = np.linalg.inv(np.linalg.cholesky(self.inertia[i])).T
        self.start = self._start(mechanism)
        self.rank = independent_anywhere(self.start, self._residual_and_rows, self._moved)

    def _start(self, mechanism: Mechanism) -> Array:
        motion = Tree(mechanism).at(*mechanism.start())
        R, w = motion.R_WB[: self._count], motion.w_WB[: self._count]
        arm = np.einsum("nij,nj->ni", R, self.com)
        quaternions = np.array([to_quaternion(rotation) for rotation in R])
        v = motion.v_WB[: self._count] + cross(w, arm)
        r = motion.p_WB[: self._count] + arm
        return _joined(r, quaternions, v, np.einsum("nji,nj->ni", R, w))

    def parts(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """r, quaternions, v and ω (own axes) of a state, (bodies, …)."""
        n = self._count
        return (
            x[: 3 * n].reshape(n, 3),
            x[3 * n : 7 * n].reshape(n, 4),
            x[7 * n : 10 * n].reshape(n, 3),
            x[10 * n :].reshape(n, 3),
        )

    def bodies(self, x: Array) -> Bodies:
        """Motion of the bodies, and of the world."""
        n = self._count
        r, q, v, w = self.parts(x)
        R = np.empty((n + 1, 3, 3))
        R[:n], R[n] = rotations(q), np.eye(3)
        padded = np.zeros((3, n + 1, 3))
        padded[0, :n], padded[1, :n] = r, v
        padded[2, :n] = np.matmul(R[:n], w[:, :, None])[:, :, 0]
        return Bodies(padded[0], R, padded[1], padded[2])

    def _residual_and_rows(self, x: Array) -> tuple[Array, Array]:
        bodies = self.bodies(x)
        rows = self.connections.rows(bodies, self.connections.ends(bodies))
        return rows.residual, rows.C

    def solve(self, x: Array) -> SolvedState:
        """Projections of the equations of motion at a state."""
        bodies = self.bodies(x)
        ends = self.connections.ends(bodies)
        rows = self.connections.rows(bodies, ends)
        free = self._root.T @ self.applied(bodies, self.parts(x)[3], ends)
        if not self.rank:
            return SolvedState(self._root @ free, np.zeros(len(rows.C)), bodies, ends, rows)
        locked, back = self._split(rows.C)
        normal = -back @ rows.drift - locked @ free  # what the constraints change in their own subspace
        return SolvedState(self._root @ (free + locked.T @ normal), back.T @ normal, bodies, ends, rows)

    def _split(self, C: Array) -> tuple[Array, Array]:
        """Unit vectors of the constrained subspace, (rank, 6 bodies), and what takes values of rows to them."""
        from scipy.linalg.lapack import dgesdd  # here: whoever runs a ball need not wait for it

        U, S, Vt, failed = dgesdd(C @ self._root, full_matrices=0)
        if failed:
            raise np.linalg.LinAlgError("the singular values were not found")
        r = self.rank
        return Vt[:r], U[:, :r].T / S[:r, None]

    def rates(self, x: Array) -> Array:
        """ẋ."""
        _, q, v, w = self.parts(x)
        acceleration = self.solve(x).acceleration.reshape(self._count, 6)
        return _joined(v, quaternion_rates(q, w), acceleration[:, :3], acceleration[:, 3:])

    def eliminated(self, x: Array) -> Array:
        """The state with its violations taken away within the constrained subspace; quaternions of unit length."""
        x = self._with_unit_quaternions(x)
        if not self.rank:
            return x
        residual, C = self._residual_and_rows(x)
        locked, back = self._split(C)
        into = self._root @ locked.T
        r, q, v, w = self.parts(x)
        u = np.concatenate([v, w], axis=1).ravel()
        u = (u - into @ (back @ (C @ u))).reshape(self._count, 6)
        return self._moved(_joined(r, q, u[:, :3], u[:, 3:]), -into @ (back @ residual))

    def accept(self, x: Array) -> None:
        """Tells the forces that the motion goes on from a state."""
        if self.applied.remembers:
            self.applied.accept(self.connections.ends(self.bodies(x)))

    def _with_unit_quaternions(self, x: Array) -> Array:
        x = x.copy()
        q = self.parts(x)[1]
        q /= np.sqrt((q * q).sum(1))[:, None]
        return x

    def _moved(self, x: Array, step: Array) -> Array:
        """The state after a small motion of the bodies, to first order."""
        x, step = x.copy(), step.reshape(self._count, 6)
        r, q, _, _ = self.parts(x)
        q += quaternion_rates(q, step[:, 3:])
        r += step[:, :3]
        return self._with_unit_quaternions(x)


def _joined(*parts: Array) -> Array:
    """A state, or its rates, from r, quaternions, v and ω."""
    return np.concatenate([part.ravel() for part in parts])


def _rotation(p: Array, q: Array) -> Array:
    """Bilinear in lists of quaternions (w, x, y, z): of one with itself its rotation, and its length, both squared."""
    (a, b, c, d), (w, x, y, z) = p.T, q.T
    rows = (
        (a * w + b * x - c * y - d * z, 2 * (b * y - a * z), 2 * (b * z + a * y)),
        (2 * (b * y + a * z), a * w - b * x + c * y - d * z, 2 * (c * z - a * x)),
        (2 * (b * z - a * y), 2 * (c * z + a * x), a * w - b * x - c * y + d * z),
    )
    return np.array([*rows[0], *rows[1], *rows[2], a * w + b * x + c * y + d * z]).T


def _rate(q: Array, w: Array) -> Array:
    """Bilinear: half the products of quaternions and angular velocities along the bodies' own axes."""
    (a, b, c, d), (x, y, z) = q.T, 0.5 * w.T
    return np.array((-b * x - c * y - d * z, a * x + c * z - d * y, a * y + d * x - b * z, a * z + b * y - c * x)).T


# Both of all pairs of units: the products of all pairs of elements times these are three calls of numpy, not thirty.
_ROTATION = _rotation(np.repeat(np.eye(4), 4, axis=0), np.tile(np.eye(4), (4, 1)))
_RATE = _rate(np.repeat(np.eye(4), 3, axis=0), np.tile(np.eye(3), (4, 1)))


def rotations(q: Array) -> Array:
    """Rotation matrices of quaternions (w, x, y, z) of any length but zero, (bodies, 3, 3)."""
    found = (q[:, :, None] * q[:, None, :]).reshape(-1, 16) @ _ROTATION
    return np.asarray((found[:, :9] / found[:, 9:]).reshape(-1, 3, 3))


def quaternion_rates(q: Array, w: Array) -> Array:
    """Half the product of quaternions and angular velocities along the bodies' own axes, (bodies, 4)."""
    return np.asarray((q[:, :, None] * w[:, None, :]).reshape(-1, 12) @ _RATE)
