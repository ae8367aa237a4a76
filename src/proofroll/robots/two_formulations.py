"""Truth of a robot at given states, by two formulations that share only the motion within one joint.

A, here: Jacobians in world axes, M = Σ Jᵀ I J, and h from the accelerations that remain at zero joint accelerations.
B, :mod:`proofroll.robots.body_recursion`: recursive Newton-Euler with spatial vectors in body axes.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.robots.model import WORLD, Array, Robot, RobotJoint
from proofroll.robots.states import RobotStates


@dataclasses.dataclass(frozen=True)
class Dynamics:
    """Terms of the equation of motion M a + h + passive = τ; the first axis counts states.

    Attributes:
        M: mass matrix with armature, shape (states, n, n).
        g: torque that holds the robot at rest, shape (states, n).
        h: torque that gives zero accelerations without passive forces, shape (states, n).
    """

    M: Array
    g: Array
    h: Array

    def first(self, count: int) -> Dynamics:
        """Terms at the first states alone."""
        return Dynamics(self.M[:count], self.g[:count], self.h[:count])

    @cached_property
    def smallest(self) -> float:
        """The smallest eigenvalue of M with velocities scaled by their own inertia; 0 where one has none."""
        own = np.sqrt(np.abs(np.diagonal(self.M, axis1=1, axis2=2)))
        if not own.size or not own.min():
            return 0.0
        return float(np.linalg.eigvalsh(self.M / own[:, :, None] / own[:, None, :]).min())


def passive(robot: Robot, states: RobotStates) -> Array:
    """Damping, Coulomb friction and springs as a torque against the motion, shape (states, n)."""
    v = states.stacked(states.velocity, robot)
    torques = np.zeros_like(v)
    for joint in robot.moving:
        columns = robot.columns[joint.name]
        torques[:, columns] = joint.damping * v[:, columns] + joint.friction * np.sign(v[:, columns])
        if joint.stiffness and joint.name in states.angle:
            torques[:, columns] += joint.stiffness * (states.angle[joint.name] - joint.rest)[:, None]
    return torques


def within(joint: RobotJoint, states: RobotStates) -> tuple[Array, Array]:
    """Position and rotation of the child in its parent's frame, shapes (states, 3) and (states, 3, 3)."""
    count = states.count
    slid = np.zeros((count, 3))
    turned = np.broadcast_to(np.eye(3), (count, 3, 3))
    if joint.kind == "revolute":
        turned = Rotation.from_rotvec(states.angle[joint.name][:, None] * joint.axis).as_matrix()
    elif joint.kind == "prismatic":
        slid = states.angle[joint.name][:, None] * joint.axis
    elif joint.kind == "spherical":
        turned = states.rotation[joint.name]
    elif joint.kind == "free":
        return joint.position + states.position[joint.name], states.rotation[joint.name]
    R = joint.rotation @ turned
    return joint.position + slid @ joint.rotation.T - R @ joint.child_position, R


def poses(robot: Robot, states: RobotStates) -> dict[str, tuple[Array, Array]]:
    """Position of the origin and rotation of every body in the world, shapes (states, 3) and (states, 3, 3)."""
    placed = {WORLD: (np.zeros((states.count, 3)), np.broadcast_to(np.eye(3), (states.count, 3, 3)))}
    for joint in robot.joints:
        p, R = placed[joint.parent]
        r, Q = within(joint, states)
        placed[joint.child] = (p + _rotate(R, r), R @ Q)
    return placed


def _rotate(R: Array, r: Array) -> Array:
    return np.asarray(np.einsum("sij,sj->si", R, r))


def skew(r: Array) -> Array:
    """The matrix of r × for each row."""
    matrix = np.zeros((*r.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -r[..., 2], r[..., 1], -r[..., 0]
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = r[..., 2], -r[..., 1], r[..., 0]
    return matrix


@dataclasses.dataclass
class _Motion:
    """Motion of a body in world axes: Jacobians, angular velocity, accelerations at zero joint accelerations."""

    Jv: Array
    Jw: Array
    w: Array
    a: Array
    alpha: Array


def world_jacobians(robot: Robot, states: RobotStates) -> Dynamics:
    """Formulation A."""
    count, n = states.count, robot.dofs
    v = states.stacked(states.velocity, robot)
    frames = poses(robot, states)
    rest = np.zeros((count, 3))
    motions = {WORLD: _Motion(np.zeros((count, 3, n)), np.zeros((count, 3, n)), rest, rest, rest)}
    M = np.zeros((count, n, n))
    g, c = np.zeros((count, n)), np.zeros((count, n))
    for joint in robot.joints:
        motion = motions[joint.child] = _carried(robot, joint, motions[joint.parent], frames, v)
        body = robot.bodies[joint.child]
        R = frames[joint.child][1]
        r = R @ body.com
        Jc = motion.Jv - skew(r) @ motion.Jw
        ac = motion.a + np.cross(motion.alpha, r) + np.cross(motion.w, np.cross(motion.w, r))
        inertia = R @ body.inertia @ R.transpose(0, 2, 1)
        torque = _rotate(inertia, motion.alpha) + np.cross(motion.w, _rotate(inertia, motion.w))
        M += body.mass * Jc.transpose(0, 2, 1) @ Jc + motion.Jw.transpose(0, 2, 1) @ inertia @ motion.Jw
        g -= body.mass * np.einsum("sij,i->sj", Jc, robot.gravity)
        c += body.mass * np.einsum("sij,si->sj", Jc, ac) + np.einsum("sij,si->sj", motion.Jw, torque)
    return Dynamics(M + np.diag(armature(robot)), g, g + c + turned_armature(robot, v))


def armature(robot: Robot) -> Array:
    """Armature of every velocity, shape (n,)."""
    return np.concatenate([np.zeros(0), *(np.full(joint.dofs, joint.armature) for joint in robot.moving)])


def turned_armature(robot: Robot, v: Array) -> Array:
    """Force of armature along axes that turn with a free body: −armature ω × v, shape (states, n)."""
    torques = np.zeros_like(v)
    for joint in robot.moving:
        if joint.turning:
            rate = v[:, robot.columns[joint.name]]
            columns = slice(robot.columns[joint.name].start, robot.columns[joint.name].start + 3)
            torques[:, columns] = -joint.armature * np.cross(rate[:, 3:], rate[:, :3])
    return torques


def _carried(
    robot: Robot, joint: RobotJoint, parent: _Motion, frames: dict[str, tuple[Array, Array]], v: Array
) -> _Motion:
    (p_parent, R_parent), (p, R) = frames[joint.parent], frames[joint.child]
    r = p - p_parent
    Jv, Jw = parent.Jv - skew(r) @ parent.Jw, parent.Jw.copy()
    if joint.kind == "fixed":
        return _Motion(Jv, Jw, parent.w, parent.a + _swung(parent, r), parent.alpha)
    columns = robot.columns[joint.name]
    rate = v[:, columns]
    if joint.kind == "free":
        Jv[:, :, columns], Jw[:, :, columns] = np.eye(3, 6), np.eye(3, 6, 3)
        return _Motion(Jv, Jw, rate[:, 3:], np.zeros_like(p), np.zeros_like(p))
    u = R @ (np.eye(3) if joint.kind == "spherical" else joint.axis[:, None])  # (states, 3, velocities)
    relative = np.einsum("sij,sj->si", u, rate)
    if joint.kind == "prismatic":
        Jv[:, :, columns] = u
        a = parent.a + _swung(parent, r) + 2 * np.cross(parent.w, relative)
        return _Motion(Jv, Jw, parent.w, a, parent.alpha)
    anchor = p_parent + _rotate(R_parent, np.broadcast_to(joint.position, p.shape))
    Jw[:, :, columns], Jv[:, :, columns] = u, -skew(p - anchor) @ u
    w, alpha = parent.w + relative, parent.alpha + np.cross(parent.w, relative)
    a = parent.a + _swung(parent, anchor - p_parent)
    a = a + np.cross(alpha, p - anchor) + np.cross(w, np.cross(w, p - anchor))
    return _Motion(Jv, Jw, w, a, alpha)


def _swung(motion: _Motion, r: Array) -> Array:
    """Acceleration of a point of the body at r against that of its origin."""
    return np.cross(motion.alpha, r) + np.cross(motion.w, np.cross(motion.w, r))
