"""Truth of a robot at given states, by two formulations that share nothing but the robot's data and its armatures.

A, here: Jacobians in world axes of the tree of scenes, M = Σ Jᵀ I J, and h from the accelerations that remain at zero
joint accelerations.
B, :mod:`proofroll.robots.check.body_recursion`: recursive Newton-Euler with spatial vectors in body axes.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import WORLD, Body, Joint, Mechanism, Tree
from proofroll.elements.mechanism.scene.checks import ZERO, Z
from proofroll.elements.mechanism.scene.joint_kinds import ONE_COORDINATE, JointKind
from proofroll.elements.mechanism.scene.rotations import skews, to_quaternion
from proofroll.robots.model import NO_BODY, Array, Robot
from proofroll.robots.states import RobotStates

# Smallest eigenvalue of the scaled mass matrix that counts as nonzero: some 64 velocities times round-off.
_SINGULAR = 1e-14
# Largest matrix product, in multiplications, that OpenBLAS computes in one thread; more threads are slower here.
_ALONE = 2**18
_FIELDS = ("p_WB", "R_WB", "w_WB", "J", "bias")  # of a motion of a scene's tree


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


Frames = dict[str, tuple[Array, Array]]


def _tree_of(robot: Robot) -> tuple[Tree, dict[str, Array]]:
    """Tree of a scene with the joints of a robot, and body -> axes that it has there, in its own.

    Bodies and joints are numbered, and all axes are the world's where coordinates are 0, up to the turn of a free base.
    """
    names = {NO_BODY: WORLD} | {joint.child: f"body {number}" for number, joint in enumerate(robot.joints)}
    axes, joints = {NO_BODY: np.eye(3)}, []
    for number, joint in enumerate(robot.joints):
        free = joint.kind == JointKind.FREE
        axes[joint.child] = S = np.eye(3) if free else joint.rotation.T @ axes[joint.parent]
        joints.append(
            Joint(
                name=f"joint {number}",
                kind=JointKind(joint.kind),
                parent=names[joint.parent],
                child=names[joint.child],
                position=ZERO if free else tuple(axes[joint.parent].T @ joint.position),
                axis=tuple(S.T @ joint.axis) if joint.kind in ONE_COORDINATE else Z,
                child_position=tuple(S.T @ joint.child_position),
            )
        )
    return Tree(Mechanism(tuple(Body(names[joint.child], 1.0) for joint in robot.joints), tuple(joints))), axes


@dataclasses.dataclass(frozen=True)
class TreeMotion:
    """Motion of a robot by the tree of a scene; the first axis of arrays counts states.

    Attributes:
        frames: body -> position of its origin and its rotation in the world, shapes (states, 3) and (states, 3, 3).
        J: derivative of the velocities of all origins and of the angular velocities, in world axes, by the robot's
            velocities, shape (states, bodies, 6, n); bodies in the order of joints.
        bias: accelerations at zero joint accelerations, shape (states, bodies, 6).
        w: angular velocities, shape (states, bodies, 3).
    """

    frames: Frames
    J: Array
    bias: Array
    w: Array

    @classmethod
    def of(cls, robot: Robot, states: RobotStates) -> TreeMotion:
        """Motion of a robot at some states."""
        tree, axes = _tree_of(robot)
        count, nv, moved = states.count, tree.mechanism.nv, tree.mechanism
        q, T, drift = np.zeros((count, moved.nq)), np.zeros((count, nv, robot.dofs)), np.zeros((count, nv))
        places = {joint.name: moved.joint_index[f"joint {number}"] for number, joint in enumerate(robot.joints)}
        free = []
        for joint in robot.moving:
            at_q, at_v = moved.q_slices[places[joint.name]], moved.v_slices[places[joint.name]]
            S, columns = axes[joint.child], robot.columns[joint.name]
            if joint.dofs == 1:
                q[:, at_q.start], T[:, at_v, columns] = states.angle[joint.name], 1.0
                continue
            R = states.rotation[joint.name]
            q[:, at_q.stop - 4 : at_q.stop] = to_quaternion(S.T @ R @ S)
            T[:, at_v, columns] = S.T if joint.dofs == 3 else np.kron(np.eye(2), R.swapaxes(1, 2))
            if joint.kind == JointKind.FREE:
                q[:, at_q.start : at_q.start + 3] = joint.position + states.position[joint.name]
                free.append(at_v)
        v = (T @ states.stacked(states.velocity, robot)[..., None])[..., 0]
        for at_v in free:  # its velocity along the body's axes turns with them
            drift[:, at_v.start : at_v.start + 3] = cross(v[:, at_v][:, :3], v[:, at_v][:, 3:])
        motions = [tree.at(*state) for state in zip(q, v, strict=True)]
        p, R, w, J, bias = (np.array([getattr(motion, name)[:-1] for motion in motions]) for name in _FIELDS)
        return cls(
            frames={joint.child: (p[:, k], R[:, k] @ axes[joint.child].T) for k, joint in enumerate(robot.joints)},
            J=J @ T[:, None],
            bias=bias + (J @ drift[:, None, :, None])[..., 0],
            w=w,
        )


def world_jacobians(robot: Robot, states: RobotStates, motion: TreeMotion | None = None) -> Dynamics:
    """Terms of the equation of motion by Jacobians in world axes (formulation A).

    ``motion`` is that of the robot, if it is known already.
    """
    motion = TreeMotion.of(robot, states) if motion is None else motion
    bodies = [robot.bodies[joint.child] for joint in robot.joints]
    mass = np.array([body.mass for body in bodies])[:, None]
    R = np.stack([motion.frames[joint.child][1] for joint in robot.joints], axis=1)
    r = (R @ np.array([body.com for body in bodies])[..., None])[..., 0]
    inertia = R @ np.array([body.inertia for body in bodies]) @ R.swapaxes(2, 3)
    w, Jw = motion.w, motion.J[:, :, 3:]
    a, alpha = motion.bias[..., :3], motion.bias[..., 3:]
    Jc = motion.J[:, :, :3] - skews(r) @ Jw
    ac = a + cross(alpha, r) + cross(w, cross(w, r))
    Iw, Ialpha = ((inertia @ rate[..., None])[..., 0] for rate in (w, alpha))
    M = _summed(mass[..., None] * Jc, Jc) + _summed(inertia @ Jw, Jw)
    g = -_summed(Jc, np.broadcast_to(mass * robot.gravity, ac.shape)[..., None])[..., 0]
    c = _summed(Jc, (mass * ac)[..., None])[..., 0] + _summed(Jw, (Ialpha + cross(w, Iw))[..., None])[..., 0]
    v = states.stacked(states.velocity, robot)
    return Dynamics(M + np.diag(armature(robot)), g, g + c + turned_armature(robot, v))


def _summed(A: Array, B: Array) -> Array:
    """Sum of Aᵀ B over bodies, shape (states, any, any), of arrays of shape (states, bodies, 3, any)."""
    left, right = (array.reshape(len(array), -1, array.shape[3]) for array in (A, B))
    total = np.zeros((len(A), A.shape[3], B.shape[3]))
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
