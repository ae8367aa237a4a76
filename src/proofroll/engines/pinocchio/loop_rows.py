"""Formulation ``null_space``: rows of the loops from Pinocchio's frames, and the split they make of its velocities.

With M = L Lᵀ, the singular vectors of C L⁻ᵀ split velocities into those that the loops lock and those that they allow.
Which row depends on which never matters, and the number of independent ones is found once, at the start: where it is
found anew at each evaluation, it flickers with round-off.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtrtri

from proofroll.engines.pinocchio.joint_tree import JointTree
from proofroll.mechanisms.joint import FACTS
from proofroll.mechanisms.rotations import Array, cross
from proofroll.mechanisms.sampling import independent

_NEARBY = 0.05  # rad or m: far enough from a singular start to see the rank that holds in general


class Rows(NamedTuple):
    """Φ, C with C v = Φ̇, Ċ v; and of each row its loop, and the force and moment on body_b of a unit multiplier."""

    residual: Array
    C: Array
    drift: Array
    loop: NDArray[np.intp]
    force: Array
    torque: Array


class Split(NamedTuple):
    """L⁻ᵀ, its product with the locked directions, and what takes a row's value to them."""

    into: Array
    locked: Array
    back: Array


class LoopRows:
    """The rows of all loops of a tree.

    Attributes:
        rank: number of independent rows.
    """

    def __init__(self, tree: JointTree) -> None:
        self._tree, self._model = tree, tree.model
        self.rank = 0
        if tree.loops:
            data = self._model.createData()
            at_start = self.at(data, tree.q0, tree.v0)
            self.rank = independent(at_start.C)
            self.rank = max(self.rank, independent(self._nearby(data, at_start).C))

    def at(self, data: Any, q: Array, v: Array) -> Rows:
        """Rows at a state; positions, velocities and drifts of all frames are in ``data`` then."""
        model = self._model
        pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        parts = [self._of(data, number) for number in range(len(self._tree.loops))]
        loop = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
        residual, C, drift, force, torque = (np.concatenate(column) for column in zip(*parts, strict=True))
        return Rows(residual, C, drift, loop, force, torque)

    def _of(self, data: Any, number: int) -> tuple[Array, Array, Array, Array, Array]:
        (p_a, A, J_a, w_a, a_a), (p_b, B, J_b, w_b, a_b) = (self._frame(data, f) for f in self._tree.loops[number])
        facts = FACTS[self._tree.mechanism.loops[number].kind]
        J, a, d = J_b - J_a, a_b - a_a, p_b - p_a
        residual, C, drift, force, torque = [], [], [], [], []
        for k in facts.translations:
            n = A[:, k]
            if len(facts.translations) == 3:  # points that coincide do so along the world's axes too
                n = np.eye(3)[k]
                row, rate = J[k], a[k]
            else:  # d(n·d)/dt with n fixed in body_a, twice
                n_rate, r = cross(w_a[0], n), cross(d, n)
                row = n @ J[:3] - r @ J_a[3:]
                speed = w_b[1] - w_a[1]
                rate = n @ a[:3] - r @ a_a[3:] + 2 * n_rate @ speed + cross(w_a[0], n_rate) @ d
            residual.append(n @ d)
            C.append(row)
            drift.append(rate)
            force.append(n)
            torque.append(np.zeros(3))
        for k, m in facts.rotations:
            x, y = A[:, k], B[:, m]
            t, x_rate, y_rate = cross(y, x), cross(w_a[0], x), cross(w_b[0], y)
            residual.append(x @ y)
            C.append(t @ J[3:])
            rate = t @ a[3:] + cross(w_a[0], x_rate) @ y + 2 * x_rate @ y_rate + x @ cross(w_b[0], y_rate)
            drift.append(rate)
            force.append(np.zeros(3))
            torque.append(t)
        return np.array(residual), np.array(C), np.array(drift), np.array(force), np.array(torque)

    def _frame(self, data: Any, frame: int) -> tuple[Array, Array, Array, tuple[Array, Array], Array]:
        """Place, axes, Jacobian, (angular velocity, velocity) and acceleration at v̇ = 0 of a frame, world axes."""
        model, pose = self._model, data.oMf[frame]
        if model.frames[frame].parentJoint == 0:
            still = np.zeros(3)
            return pose.translation, pose.rotation, np.zeros((6, model.nv)), (still, still), np.zeros(6)
        J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, model.nv)
        velocity = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        return pose.translation, pose.rotation, J, (velocity.angular, velocity.linear), acceleration.vector

    def split(self, M: Array, C: Array) -> Split:
        """How the rows split velocities, in the metric of the mass matrix (upper triangle)."""
        upper, failed = dpotrf(M, lower=0)
        if failed:
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        into = dtrtri(upper, lower=0)[0]
        U, S, Vt = np.linalg.svd(C @ into, full_matrices=False)
        r = self.rank
        return Split(into, into @ Vt[:r].T, U[:, :r].T / S[:r, None])

    def eliminated(self, data: Any, q: Array, v: Array) -> tuple[Array, Array]:
        """The state with violations of the loops taken away along the locked directions (Blajer 2002)."""
        rows = self.at(data, q, v)
        split = self.split(pin.crba(self._model, data, q), rows.C)
        v = v - split.locked @ (split.back @ (rows.C @ v))
        return pin.integrate(self._model, q, -split.locked @ (split.back @ rows.residual)), v

    def _nearby(self, data: Any, rows: Rows) -> Rows:
        """The rows at a pose near the start that the loops allow and that no symmetry distinguishes."""
        n = self._model.nv
        direction = 1.0 + np.modf(np.arange(1, n + 1) * 0.6180339887498949)[0]  # golden ratio: no two alike
        direction -= np.linalg.pinv(rows.C, 1e-8) @ (rows.C @ direction)
        step = _NEARBY * direction / max(np.abs(direction).max(), 1e-300)
        q = pin.integrate(self._model, self._tree.q0, step)
        for _ in range(10):  # Newton's method doubles the digits; four rounds do from so near
            rows = self.at(data, q, np.zeros(n))
            q = pin.integrate(self._model, q, -np.linalg.pinv(rows.C, 1e-8) @ rows.residual)
        return rows
