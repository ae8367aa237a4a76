"""Truth of a robot at given states, by two formulations that share only the motion within one joint.

A, here: Jacobians in world axes, M = Σ Jᵀ I J, and h from the accelerations that remain at zero joint accelerations.
B, :mod:`proofroll.robots.check.body_recursion`: recursive Newton-Euler with spatial vectors in body axes.
"""

import dataclasses
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import cross
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import skews
from proofroll.robots.model import NO_BODY, Array, Robot, RobotJoint
from proofroll.robots.states import RobotStates

# Smallest eigenvalue of the scaled mass matrix that counts as nonzero: some 64 velocities times round-off.
_SINGULAR = 1e-14
# Largest matrix product, in multiplications, that OpenBLAS computes in one thread; more threads are slower here.
_ALONE = 2**18


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

    @cached_property
    def singular(self) -> bool:
        """True if the mass matrix, every velocity scaled by its own inertia, has no inverse within round-off."""
        scales = np.sqrt(np.abs(np.diagonal(self.M, axis1=1, axis2=2)))
        if not scales.size or not scales.min():
            return True
        try:  # Cholesky succeeds if all eigenvalues exceed the bound
            np.linalg.cholesky(self.M / scales[:, :, None] / scales[:, None, :] - _SINGULAR * np.eye(scales.shape[1]))
        except np.linalg.LinAlgError:
            return True
        return False


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
    if joint.kind == JointKind.REVOLUTE:
        turned = Rotation.from_rotvec(states.angle[joint.name][:, None] * joint.axis).as_matrix()
    elif joint.kind == JointKind.PRISMATIC:
        slid = states.angle[joint.name][:, None] * joint.axis
    elif joint.kind == JointKind.SPHERICAL:
        turned = states.rotation[joint.name]
    elif joint.kind == JointKind.FREE:
        return joint.position + states.position[joint.name], states.rotation[joint.name]
    R = joint.rotation @ turned
    return joint.position + slid @ joint.rotation.T - R @ joint.child_position, R


Frames = dict[str, tuple[Array, Array]]


def poses(robot: Robot, states: RobotStates) -> Frames:
    """Position of the origin and rotation of every body in the world, shapes (states, 3) and (states, 3, 3)."""
    placed = {NO_BODY: (np.zeros((states.count, 3)), np.broadcast_to(np.eye(3), (states.count, 3, 3)))}
    for joint in robot.joints:
        p, R = placed[joint.parent]
        r, Q = within(joint, states)
        placed[joint.child] = (p + _rotate(R, r), R @ Q)
    return placed


def _rotate(R: Array, r: Array) -> Array:
    return np.asarray(np.einsum("sij,sj->si", R, r))


@dataclasses.dataclass
class _Motion:
    """Motion of a body in world axes: Jacobians, angular velocity, accelerations at zero joint accelerations."""

    Jv: Array
    Jw: Array
    w: Array
    a: Array
    alpha: Array


def world_jacobians(robot: Robot, states: RobotStates, frames: Frames | None = None) -> Dynamics:
    """Terms of the equation of motion by Jacobians in world axes (formulation A).

    ``frames`` are the :func:`poses`, if they are known already.
    """
    count, n = states.count, robot.dofs
    v = states.stacked(states.velocity, robot)
    frames = poses(robot, states) if frames is None else frames
    rest = np.zeros((count, 3))
    motions = {NO_BODY: _Motion(Jv=np.zeros((count, 3, n)), Jw=np.zeros((count, 3, n)), w=rest, a=rest, alpha=rest)}
    for joint in robot.joints:
        motions[joint.child] = _carried(robot, joint, motions[joint.parent], frames, v)
    M, g, c = np.zeros((count, n, n)), np.zeros((count, n)), np.zeros((count, n))
    if motions.keys() - {NO_BODY}:
        bodies = [robot.bodies[joint.child] for joint in robot.joints]
        mass = np.array([body.mass for body in bodies])[:, None]
        R = np.array([frames[joint.child][1] for joint in robot.joints])  # (bodies, states, 3, 3)
        r = R @ np.array([body.com for body in bodies])[:, None, :, None]
        inertia = R @ np.array([body.inertia for body in bodies])[:, None] @ R.swapaxes(2, 3)
        moving = [motions[joint.child] for joint in robot.joints]
        Jv, Jw, w, a, alpha = (np.array([getattr(motion, name) for motion in moving]) for name in vars(moving[0]))
        Jc = Jv - skews(r[..., 0]) @ Jw
        ac = a + _swung(w, alpha, r[..., 0])
        Iw, Ialpha = (np.einsum("bsij,bsj->bsi", inertia, rate) for rate in (w, alpha))
        M = _summed(mass[..., None, None] * Jc, Jc) + _summed(inertia @ Jw, Jw)
        g = -_summed(Jc, np.broadcast_to((mass * robot.gravity)[:, None], ac.shape)[..., None])[..., 0]
        c = _summed(Jc, (mass[..., None] * ac)[..., None])[..., 0]
        c += _summed(Jw, (Ialpha + cross(w, Iw))[..., None])[..., 0]
    return Dynamics(M + np.diag(armature(robot)), g, g + c + turned_armature(robot, v))


def _summed(A: Array, B: Array) -> Array:
    """Sum of oneᵀ other over bodies, shape (states, any, any), of arrays of shape (bodies, states, 3, any)."""
    left, right = (array.swapaxes(0, 1).reshape(array.shape[1], -1, array.shape[3]) for array in (A, B))
    total = np.zeros((A.shape[1], A.shape[3], B.shape[3]))
    rows = max(1, _ALONE // (A.shape[3] * B.shape[3]))
    for start in range(0, left.shape[1], rows):
        total += left[:, start : start + rows].swapaxes(1, 2) @ right[:, start : start + rows]
    return total


def armature(robot: Robot) -> Array:
    """Armature of every velocity, shape (n,)."""
    return np.concatenate([np.zeros(0), *(np.full(joint.dofs, joint.armature) for joint in robot.moving)])


def turned_armature(robot: Robot, v: Array) -> Array:
    """Force of armature that acts along the axes of a free body: −armature ω × v, shape (states, n)."""
    torques = np.zeros_like(v)
    for joint in robot.moving:
        if joint.turning:
            rate = v[:, robot.columns[joint.name]]
            columns = slice(robot.columns[joint.name].start, robot.columns[joint.name].start + 3)
            torques[:, columns] = -joint.armature * np.cross(rate[:, 3:], rate[:, :3])
    return torques


def _carried(robot: Robot, joint: RobotJoint, parent: _Motion, frames: Frames, v: Array) -> _Motion:
    (p_parent, R_parent), (p, R) = frames[joint.parent], frames[joint.child]
    r = p - p_parent
    Jv, Jw = parent.Jv - skews(r) @ parent.Jw, parent.Jw.copy()
    if joint.kind == JointKind.FIXED:
        return _Motion(Jv=Jv, Jw=Jw, w=parent.w, a=parent.a + _swung(parent.w, parent.alpha, r), alpha=parent.alpha)
    columns = robot.columns[joint.name]
    rate = v[:, columns]
    if joint.kind == JointKind.FREE:
        Jv[:, :, columns], Jw[:, :, columns] = np.eye(3, 6), np.eye(3, 6, 3)
        return _Motion(Jv=Jv, Jw=Jw, w=rate[:, 3:], a=np.zeros_like(p), alpha=np.zeros_like(p))
    u = R @ (np.eye(3) if joint.kind == JointKind.SPHERICAL else joint.axis[:, None])  # (states, 3, velocities)
    relative = np.einsum("sij,sj->si", u, rate)
    if joint.kind == JointKind.PRISMATIC:
        Jv[:, :, columns] = u
        a = parent.a + _swung(parent.w, parent.alpha, r) + 2 * cross(parent.w, relative)
        return _Motion(Jv=Jv, Jw=Jw, w=parent.w, a=a, alpha=parent.alpha)
    anchor = p_parent + _rotate(R_parent, np.broadcast_to(joint.position, p.shape))
    Jw[:, :, columns], Jv[:, :, columns] = u, -skews(p - anchor) @ u
    w, alpha = parent.w + relative, parent.alpha + cross(parent.w, relative)
    a = parent.a + _swung(parent.w, parent.alpha, anchor - p_parent) + _swung(w, alpha, p - anchor)
    return _Motion(Jv=Jv, Jw=Jw, w=w, a=a, alpha=alpha)


def _swung(w: Array, alpha: Array, r: Array) -> Array:
    """Acceleration of a point at r relative to the body's origin: α × r + ω × (ω × r)."""
    return cross(alpha, r) + cross(w, cross(w, r))
