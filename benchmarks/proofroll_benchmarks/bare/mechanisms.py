"""Steps of scipy and of Runge and Kutta, and Pinocchio's mechanisms of revolute joints by these.

Pinocchio's model comes from the adapter's builder, since a user would make the same bodies and joints; what runs in
time is written here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import DOP853

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.sampling import independent, mechanism_of
from proofroll_benchmarks.bare import Bare

_SAME_STEPS = "the same steps; sums are in another order"


def pinocchio_null_space(scene: Scene, settings: Any) -> Bare:
    """Runge and Kutta's method on ``aba``, or on the null space of the rows of revolute loops."""
    import pinocchio as pin

    from proofroll.engines.pinocchio.joint_tree import JointTree

    mechanism = mechanism_of(scene)
    if settings.formulation != "null_space" or settings.integrator != "rk4":
        raise Refused("there is a bare loop of mechanisms only for null_space with rk4")
    _only_revolute(mechanism)
    tree = JointTree(mechanism)
    model, n = tree.model, tree.model.nv
    data, tau, rest = model.createData(), np.zeros(n), np.zeros(n)
    world = pin.LOCAL_WORLD_ALIGNED

    def rows(q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Violations, rows and drifts: points together, x and y of the one axis system across z of the other."""
        pin.forwardKinematics(model, data, q, v, rest)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        off, C, drift = [], [], []
        for a, b in tree.loops:
            J_a, J_b = (pin.getFrameJacobian(model, data, frame, world) for frame in (a, b))
            w_a, w_b = (pin.getFrameVelocity(model, data, frame, world).angular for frame in (a, b))
            acc_a, acc_b = (pin.getFrameClassicalAcceleration(model, data, frame, world) for frame in (a, b))
            A, B = data.oMf[a].rotation, data.oMf[b].rotation
            x, z, J = A[:, :2].T, B[:, 2], J_b - J_a
            t = np.cross(z, x)
            x_rate, z_rate = np.cross(w_a, x), np.cross(w_b, z)
            off += [data.oMf[b].translation - data.oMf[a].translation, x @ z]
            C += [J[:3], t @ J[3:]]
            turned = np.cross(w_a, x_rate) @ z + 2 * x_rate @ z_rate + x @ np.cross(w_b, z_rate)
            drift += [acc_b.linear - acc_a.linear, t @ (acc_b.angular - acc_a.angular) + turned]
        return np.concatenate(off), np.concatenate(C), np.concatenate(drift)

    rank = independent(rows(tree.q0, tree.v0)[1]) if tree.loops else 0

    def split(C: FloatArray, into: FloatArray) -> tuple[FloatArray, FloatArray]:
        U, S, Vt = np.linalg.svd(C @ into, full_matrices=False)
        return into @ Vt[:rank].T, U[:, :rank].T / S[:rank, None]

    def root(q: FloatArray) -> FloatArray:
        M = pin.crba(model, data, q)
        return np.linalg.inv(np.linalg.cholesky(np.triu(M) + np.triu(M, 1).T)).T

    def rates(y: FloatArray) -> FloatArray:
        q, v = y[:n], y[n:]
        if not rank:
            return np.concatenate([v, pin.aba(model, data, q, v, tau)])
        _, C, drift = rows(q, v)
        into = root(q)
        free = into @ (into.T @ (tau - pin.rnea(model, data, q, v, rest)))
        locked, back = split(C, into)
        return np.concatenate([v, free - locked @ (back @ (drift + C @ free))])

    def eliminated(y: FloatArray) -> FloatArray:
        q, v = y[:n], y[n:]
        off, C, _ = rows(q, v)
        locked, back = split(C, root(q))
        return np.concatenate([q - locked @ (back @ off), v - locked @ (back @ (C @ v))])

    eliminates = bool(settings.projection and rank)

    def run(times: FloatArray) -> FloatArray:
        y = rk4(rates, np.concatenate([tree.q0, tree.v0]), times, settings.dt, eliminated if eliminates else None)
        pin.framesForwardKinematics(model, data, y[:n])
        return np.array([data.oMf[frame].translation for frame in tree.body])

    return Bare(run, 1e-11, _SAME_STEPS)


def dop853(solver: DOP853, times: FloatArray, accepted: Callable[[DOP853, float], None]) -> None:
    """Steps, one of them ending at each time; ``accepted`` may change the state after each of them."""
    for t in times[1:].tolist():
        solver.t_bound, solver.status = t, "running"
        while solver.status == "running":
            wanted = solver.h_abs
            if solver.step() is not None:
                raise Diverged("the step size fell to nothing")
            if solver.t == t:
                solver.h_abs = max(wanted, solver.h_abs)
            accepted(solver, t)


def rk4(
    rates: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    times: FloatArray,
    h: float,
    after: Callable[[FloatArray], FloatArray] | None,
) -> FloatArray:
    """State at the last time by steps of the classical method, each followed by ``after``."""
    for interval in np.diff(times).tolist():
        for _ in range(round(interval / h)):
            k1 = rates(y)
            k2 = rates(y + h / 2 * k1)
            k3 = rates(y + h / 2 * k2)
            y = y + h / 6 * (k1 + 2 * (k2 + k3) + rates(y + h * k3))
            if after is not None:
                y = after(y)
            if not np.isfinite(y.sum()):
                raise Diverged("the state is not finite")
    return y


def _only_revolute(mechanism: Any) -> None:
    kinds = {item.kind for item in (*mechanism.joints, *mechanism.loops)}
    laws = [joint.stiffness or joint.damping or joint.torque for joint in mechanism.joints]
    if kinds != {"revolute"} or any(laws) or mechanism.springs:
        raise Refused("the bare loop of mechanisms is written for revolute joints and loops without springs")
