"""Formulation ``null_space``: Pinocchio's terms of the joint tree, loops by projection on their rows' null space.

With M = L Lᵀ, the singular vectors of C L⁻ᵀ split velocities into those that the loops lock and those that they allow.
It does not matter which rows are dependent. The number of independent rows is determined once, at the start, since
round-off would make it change from one evaluation to the next.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesdd, dpotrf, dtrtri

from proofroll.core.arrays import cross
from proofroll.elements.mechanism.run.sampling import independent_anywhere
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, LOOP_FACTS, rows_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree


class RowsAtState(NamedTuple):
    """Rows at one state, in world axes.

    Attributes:
        residual: Φ.
        C: Jacobian with C v = Φ̇.
        drift: Ċ v, of a prescribed motion less its acceleration.
        rate: Φ̇ of the rows where they hold; 0.0 where all are constant.
        loop: index of the loop of each of its rows.
        force, torque: applied to body_b by a unit multiplier of each row.
    """

    residual: Array
    C: Array
    drift: Array
    rate: Array | float
    loop: NDArray[np.intp]
    force: Array
    torque: Array


class Split(NamedTuple):
    """Matrices that split velocities: L⁻ᵀ, L⁻ᵀ times the locked directions, and row values to locked components."""

    into: Array
    locked: Array
    back: Array


class LoopRows:
    """Rows of all loops of a tree, then of its couplings, then of its prescribed motions.

    Attributes:
        rank: number of independent rows.
    """

    def __init__(self, tree: JointTree) -> None:
        self._model, self._tree = tree.model, tree
        kinds = [loop.kind for loop in tree.mechanism.loops]
        (self._point, self._axis), (self._angle, self._x, self._y) = rows_of(kinds)
        # True where a row's direction turns with body_a; coincident points need no such rows and use world axes
        self._turning = np.array(
            [0 < len(LOOP_FACTS[kinds[number]].translations) < 3 for number in self._point]
        ).reshape(-1, 1)
        self._fixed = np.eye(3)[self._axis]
        struts = [kinds[number] == DISTANCE for number in self._point]
        self._struts = np.flatnonzero(struts)
        self._lengths = np.array([tree.mechanism.loops[number].length for number in self._point[self._struts]])
        self._loop = np.concatenate([self._point, self._angle])
        self._ends = np.array(tree.loops, dtype=np.intp).reshape(-1, 2).T
        self._carried = [bool(frame.parentJoint) for frame in self._model.frames]
        data = self._model.createData()

        def at_rest(q: Array) -> tuple[Array, Array]:
            rows = self.at(data, q, None)
            return rows.residual, rows.C

        self.rank = 0
        if tree.closed:
            self.rank = independent_anywhere(tree.q0, at_rest, partial(pin.integrate, self._model))

    def at(self, data: Any, q: Array, v: Array | None) -> RowsAtState:
        """Rows at a state; leaves positions, velocities and drifts of all frames in ``data``.

        Without velocities the drifts are those at rest, and ``data`` has positions alone.
        """
        if not len(self._tree.geared):
            return self._of_loops(data, q, v)
        rows, (residual, rate, drift) = self._of_loops(data, q, v), self._tree.apart(q)
        return rows._replace(
            residual=np.concatenate([rows.residual, residual]),
            C=np.concatenate([rows.C, self._tree.geared]),
            drift=np.concatenate([rows.drift, drift]),
            rate=np.concatenate([np.zeros(len(rows.residual)), rate]),
        )

    def _of_loops(self, data: Any, q: Array, v: Array | None) -> RowsAtState:
        model = self._model
        if v is not None:
            pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        (p_a, A, J_a), (p_b, B, J_b) = (self._frames(data, ends) for ends in self._ends)
        J, d, i, j, strut = J_b - J_a, p_b - p_a, self._point, self._angle, self._struts
        x, y = A[j, :, self._x], B[j, :, self._y]
        t = cross(y, x)
        # products with the world's axes are components
        n, r, C, residual = self._fixed, None, J[i, self._axis], d[i, self._axis]
        sizes = np.zeros(0)
        if self._turning.any() or len(strut):
            n = np.where(self._turning, A[i, :, self._axis], n)
            sizes = np.sqrt((d[i[strut]] ** 2).sum(1))
            n[strut] = d[i[strut]] / sizes[:, None]
            r = self._turning * cross(d[i], n)
            C, residual = _times(n, J[i, :3]) - _times(r, J_a[i, 3:]), (n * d[i]).sum(1)
            residual[strut] -= self._lengths
        return RowsAtState(
            residual=np.concatenate([residual, (x * y).sum(1)]),
            C=np.concatenate([C, _times(t, J[j, 3:])]),
            drift=np.zeros(len(self._loop)) if v is None else self._drifts(data, n, r, d, (x, y, t), sizes),
            rate=0.0,
            loop=self._loop,
            force=np.concatenate([n, np.zeros_like(t)]),
            torque=np.concatenate([np.zeros_like(n), t]),
        )

    def _drifts(
        self, data: Any, n: Array, r: Array | None, d: Array, angular: tuple[Array, Array, Array], sizes: Array
    ) -> Array:
        """Drifts of rows with directions ``n``; ``r``: moments of these about body_a's points; None: they are fixed."""
        (v_a, a_a), (v_b, a_b) = (self._motions(data, ends) for ends in self._ends)
        i, j, (x, y, t), a, strut = self._point, self._angle, angular, a_b - a_a, self._struts
        # ω × each direction, and again
        spins, both = np.concatenate([v_a[j, 3:], v_b[j, 3:]]), np.concatenate([x, y])
        rates = cross(spins, both)
        bends, count = cross(spins, rates), len(x)
        turn = t * a[j, 3:] + bends[:count] * y + x * bends[count:] + 2 * rates[:count] * rates[count:]
        drift = a[i, self._axis]
        if r is not None:
            slide, w_a = (v_b - v_a)[i, :3], v_a[i, 3:]
            rates = cross(w_a, n)
            drift_along = 2 * rates * slide + cross(w_a, rates) * d[i]
            drift = (n * a[i, :3] - r * a_a[i, 3:] + self._turning * drift_along).sum(1)
            slide = slide[strut]
            drift[strut] += ((slide * slide).sum(1) - (n[strut] * slide).sum(1) ** 2) / sizes
        return np.concatenate([drift, turn.sum(1)])

    def _frames(self, data: Any, frames: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Positions, axes and Jacobians of frames, world axes; no Jacobian for the world."""
        model, count = self._model, len(frames)
        p, R, J = np.empty((count, 3)), np.empty((count, 3, 3)), np.zeros((count, 6, model.nv))
        for number, frame in enumerate(frames.tolist()):
            pose = data.oMf[frame]
            p[number], R[number] = pose.translation, pose.rotation
            if self._carried[frame]:
                jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
                J[number] = jacobian.reshape(6, model.nv)  # a single column is returned as a vector
        return p, R, J

    def _motions(self, data: Any, frames: NDArray[np.intp]) -> tuple[Array, Array]:
        """Velocities and accelerations at v̇ = 0 of frames, world axes; zero for the world."""
        model, (v, a) = self._model, np.zeros((2, len(frames), 6))
        for number, frame in enumerate(frames.tolist()):
            if self._carried[frame]:
                v[number] = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).vector
                a[number] = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED).vector
        return v, a

    def split(self, M: Array, C: Array) -> Split:
        """Splitting of velocities by the rows, in the metric of the mass matrix (upper triangle).

        Raises:
            LinAlgError: the mass matrix is not positive definite, or the singular values are not found.
        """
        if self._tree.light:
            M = M + self.weight(M, C) * C.T @ C
        upper, failed = dpotrf(M, lower=0)
        if failed:
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        into = dtrtri(upper, lower=0)[0]
        U, S, Vt, failed = dgesdd(C @ into, full_matrices=0)
        if failed:
            raise np.linalg.LinAlgError("the singular values were not found")
        r = self.rank
        return Split(into, into @ Vt[:r].T, U[:, :r].T / S[:r, None])

    def weight(self, M: Array, C: Array) -> float:
        """Factor on CᵀC that makes a singular mass matrix definite and leaves motions that the rows allow alone."""
        return float(np.abs(M).max() / np.abs(C.T @ C).max()) if self._tree.light else 0.0

    def eliminated(self, data: Any, q: Array, v: Array) -> tuple[Array, Array]:
        """State without violations of the loops, moved along the locked directions (Blajer 2002)."""
        rows = self.at(data, q, None)
        split = self.split(pin.crba(self._model, data, q), rows.C)
        v = v - split.locked @ (split.back @ (rows.C @ v - rows.rate))
        return pin.integrate(self._model, q, -split.locked @ (split.back @ rows.residual)), v


def _times(a: Array, J: Array) -> Array:
    """Product of each vector with its matrix of three rows."""
    return np.asarray(np.matmul(a[:, None, :], J)[:, 0])


class NullSpace:
    """Accelerations and reactions of a tree with loops and couplings.

    Attributes:
        on_couplings: force of each coupling on its first joint at the last call of :meth:`reactions`.
        on_motions: force of each prescribed motion on its joint then.
    """

    def __init__(self, tree: JointTree, rows: LoopRows) -> None:
        self._tree, self._model, self._rows = tree, tree.model, rows
        self._rest = np.zeros(tree.model.nv)
        self.on_couplings = self.on_motions = np.zeros(0)

    def acceleration(self, data: Any, q: Array, v: Array) -> Array:
        """Joint acceleration, shape (nv,), overwritten by the next call."""
        tree, model = self._tree, self._model
        tau = tree.drives(q, v)
        if not tree.closed:
            if not tree.pushed:
                acceleration: Array = pin.aba(model, data, q, v, tau)
                return acceleration
            pin.forwardKinematics(model, data, q, v)
            pin.updateFramePlacements(model, data)
            return np.array(pin.aba(model, data, q, v, tau, tree.pulls(data)))
        return self._solved(data, q, v, tau)[0]

    def _solved(self, data: Any, q: Array, v: Array, tau: Array) -> tuple[Array, RowsAtState, Array]:
        """Acceleration, rows, and multipliers; of dependent rows, the multipliers of least norm."""
        tree, model = self._tree, self._model
        rows = self._rows.at(data, q, v)
        pulls = tree.pulls(data) if tree.pushed else None
        M = pin.crba(model, data, q).copy()
        bias = pin.rnea(model, data, q, v, self._rest, pulls) if pulls else pin.rnea(model, data, q, v, self._rest)
        split = self._rows.split(M, rows.C)
        free = split.into @ (split.into.T @ (tau - bias))
        normal = -split.back @ (rows.drift + rows.C @ free)
        multipliers = split.back.T @ normal + self._rows.weight(M, rows.C) * rows.drift
        return free + split.locked @ normal, rows, multipliers

    def reactions(self, data: Any, q: Array, v: Array) -> tuple[Array, Any, Array]:
        """Joint acceleration; spring and loop forces on Pinocchio's joints; force and moment on body_b of each loop."""
        tree = self._tree
        on_loops = np.zeros((2, len(tree.loops), 3))
        if not tree.closed:
            acceleration = self.acceleration(data, q, v).copy()
            pin.forwardKinematics(self._model, data, q, v)
            pin.updateFramePlacements(self._model, data)
            return acceleration, tree.pulls(data), on_loops
        acceleration, rows, multipliers = self._solved(data, q, v, tree.drives(q, v))
        forces = tree.pulls(data)
        moving = len(multipliers) - len(tree.mechanism.prescribed)
        multipliers, self.on_couplings, self.on_motions = np.split(multipliers, [len(rows.loop), moving])
        np.add.at(on_loops[0], rows.loop, multipliers[:, None] * rows.force)
        np.add.at(on_loops[1], rows.loop, multipliers[:, None] * rows.torque)
        for (a, b), force, torque in zip(tree.loops, *on_loops, strict=True):
            place = data.oMf[b].translation
            tree.put(forces, data, b, place, force, torque)
            tree.put(forces, data, a, place, -force, -torque)
        return acceleration, forces, on_loops

    def constraint_rows(self, data: Any, q: Array, v: Array) -> Array:
        """Jacobian of loops and couplings for joint velocities, shape (rows, nv)."""
        return self._rows.at(data, q, v).C if self._tree.closed else np.zeros((0, self._model.nv))
