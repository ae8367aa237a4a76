"""A mechanism by Pinocchio's terms alone: the loop that measures what an adapter costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.integrate import DOP853

from proofroll.core.arrays import FloatArray
from proofroll_benchmarks.bare.steps import dop853, rk4


@dataclass
class MechanismLoop:
    """A model with what Pinocchio does not hold, and how it is stepped.

    Attributes:
        model: pin.Model.
        start: configuration and velocity at time 0.
        loops: frames at both ends, axes of the first along which they stay together, pairs of axes that stay normal.
        springs: frames at both ends, stiffness, damping, length.
        sprung: stiffness and rest of a joint, and where its coordinate and velocity are.
        drives, damping: of each velocity.
        rank: number of independent rows of the loops.
        eliminates: True if violations of the loops are taken away after each step.
        rtol: of DOP853; 0: the classical Runge-Kutta method with steps of ``dt`` [s].
        held: loops as Pinocchio's own constraints, with its proximal settings; None: projection on the null space.
    """

    model: Any
    start: FloatArray
    loops: Sequence[tuple[int, int, Sequence[int], Sequence[tuple[int, int]]]]
    springs: Sequence[tuple[int, int, float, float, float]]
    sprung: Sequence[tuple[float, float, int, int]]
    drives: FloatArray
    damping: FloatArray
    rank: int
    eliminates: bool
    dt: float = 0.0
    rtol: float = 0.0
    held: tuple[Any, Any] | None = None
    data: Any = field(init=False)

    def __post_init__(self) -> None:
        self.data, self.rest = self.model.createData(), np.zeros(self.model.nv)
        if self.held is not None:
            self.results = pin.StdVec_RigidConstraintData()
            for constraint in self.held[0]:
                self.results.append(constraint.createData())
            pin.initConstraintDynamics(self.model, self.data, self.held[0], self.results)

    def end(self, frame: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Position, axes, Jacobian, velocity, and acceleration where no joint accelerates, of a frame; world axes."""
        model, data, axes = self.model, self.data, pin.LOCAL_WORLD_ALIGNED
        pose, J, twist, rate = data.oMf[frame], np.zeros((6, model.nv)), np.zeros(6), np.zeros(6)
        if model.frames[frame].parentJoint:
            J = pin.getFrameJacobian(model, data, frame, axes).reshape(6, model.nv)
            twist = pin.getFrameVelocity(model, data, frame, axes).vector
            rate = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
        return pose.translation, pose.rotation, J, twist, rate

    def place(self, q: FloatArray, v: FloatArray) -> None:
        """Places all frames, with what moves them."""
        pin.forwardKinematics(self.model, self.data, q, v, self.rest)
        pin.computeJointJacobians(self.model, self.data, q)
        pin.updateFramePlacements(self.model, self.data)

    def rows(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Residuals of the loops, their rows C with C v = 0, and Cdot v, where the frames were placed."""
        residual, C, drift = [], [], []
        for first, second, places, turns in self.loops:
            (p_a, A, J_a, v_a, a_a), (p_b, B, J_b, v_b, a_b) = self.end(first), self.end(second)
            J, a, d, w_a, w_b = J_b - J_a, a_b - a_a, p_b - p_a, v_a[3:], v_b[3:]
            for k in places:
                n, r, rate = A[:, k], np.cross(A[:, k], d), np.cross(w_a, A[:, k])
                residual.append(n @ d)
                C.append(n @ J[:3] + r @ J_a[3:])
                drift.append(n @ a[:3] + r @ a_a[3:] + 2 * rate @ (v_b - v_a)[:3] + np.cross(w_a, rate) @ d)
            for i, j in turns:
                x, y = A[:, i], B[:, j]
                t, x_rate, y_rate = np.cross(y, x), np.cross(w_a, x), np.cross(w_b, y)
                residual.append(x @ y)
                C.append(t @ J[3:])
                bend = np.cross(w_a, x_rate) @ y + x @ np.cross(w_b, y_rate) + 2 * x_rate @ y_rate
                drift.append(t @ a[3:] + bend)
        return np.array(residual), np.array(C), np.array(drift)

    def forces(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces of drives, dampers and springs."""
        tau = self.drives - self.damping * v
        for stiffness, rest, at_q, at_v in self.sprung:
            tau[at_v] -= stiffness * (q[at_q] - rest)
        for first, second, stiffness, damping, length in self.springs:
            (p_a, _, J_a, v_a, _), (p_b, _, J_b, v_b, _) = self.end(first), self.end(second)
            d = p_b - p_a
            distance = np.linalg.norm(d)
            pull = stiffness * (distance - length) + damping * (v_b - v_a)[:3] @ d / distance
            tau += pull * d / distance @ (J_a - J_b)[:3]
        return tau

    def split(self, q: FloatArray, C: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The rows' split of velocities in the metric of the mass matrix, of a rank found once."""
        M = pin.crba(self.model, self.data, q)
        into = np.linalg.inv(np.linalg.cholesky(np.triu(M) + np.triu(M, 1).T)).T
        U, S, Vt = np.linalg.svd(C @ into, full_matrices=False)
        return into, into @ Vt[: self.rank].T, U[:, : self.rank].T / S[: self.rank, None]

    def acceleration(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Acceleration of the joints."""
        model, data = self.model, self.data
        if self.loops or self.springs:
            self.place(q, v)
        tau = self.forces(q, v)
        if self.held is not None:
            return np.array(pin.constraintDynamics(model, data, q, v, tau, self.held[0], self.results, self.held[1]))
        if not self.rank:
            return np.array(pin.aba(model, data, q, v, tau))
        _, C, drift = self.rows()
        into, locked, back = self.split(q, C)
        free = into @ (into.T @ (tau - pin.rnea(model, data, q, v, self.rest)))
        return np.asarray(free - locked @ (back @ (drift + C @ free)))

    def rates(self, y: FloatArray) -> FloatArray:
        """Rates of configuration and velocity together."""
        q, v = pin.normalize(self.model, y[: self.model.nq]), y[self.model.nq :]
        return np.concatenate([pin.tangentMap(self.model, q) @ v, self.acceleration(q, v)])

    def accepted(self, y: FloatArray) -> FloatArray:
        """A state after a step, with violations of the loops taken away."""
        q, v = pin.normalize(self.model, y[: self.model.nq]), y[self.model.nq :]
        if self.eliminates:
            self.place(q, v)
            residual, C, _ = self.rows()
            _, locked, back = self.split(q, C)
            v = v - locked @ (back @ (C @ v))
            q = pin.integrate(self.model, q, -locked @ (back @ residual))
        return np.concatenate([q, v])

    def last(self, times: FloatArray) -> FloatArray:
        """Configuration and velocity at the last of these times [s]."""
        if not self.rtol:
            return rk4(self.rates, self.start, times, self.dt, self.accepted)
        solver = DOP853(lambda _, y: self.rates(y), 0.0, self.start, np.inf, rtol=self.rtol, atol=self.rtol)
        dop853(solver, times, self.accept)
        return np.asarray(solver.y)

    def accept(self, solver: DOP853, _: float) -> None:
        """Takes away violations of loops after a step of a solver of scipy."""
        solver.y = self.accepted(solver.y)
        solver.f = self.rates(solver.y)
